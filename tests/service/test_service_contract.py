"""Generated requests against the OpenAPI description: no server error, and every answer as it is described."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
import schemathesis
from hypothesis import HealthCheck, given, settings
from hypothesis.errors import Unsatisfiable
from schemathesis import GenerationMode
from schemathesis.config import GenerationConfig, ProjectConfig, ProjectsConfig, SchemathesisConfig
from schemathesis.specs.openapi.checks import positive_data_acceptance
from serving import Server


@pytest.fixture(scope="module")
def contract(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Server]:
    """A server on which nothing takes long."""
    found = Server(tmp_path_factory.mktemp("contract") / "data", "--time-limit", "1", "--queue", "1000")
    yield found
    found.stop()


@pytest.fixture(scope="module")
def run(contract: Server) -> str:
    """A run that is there."""
    return str(contract.run(scenario={"duration": 0.05})["id"])


#: What a schema cannot say (that XML is a robot, that duration x output_rate is bounded) is refused with 422.
EXCLUDED = [positive_data_acceptance]
GENERATION = settings(
    max_examples=8, deadline=None, derandomize=True, database=None, suppress_health_check=list(HealthCheck)
)


@pytest.mark.parametrize("mode", list(GenerationMode))
def test_every_operation_answers_as_described(contract: Server, run: str, mode: GenerationMode) -> None:
    config = SchemathesisConfig(
        projects=ProjectsConfig(default=ProjectConfig(generation=GenerationConfig(deterministic=True)))
    )
    described = schemathesis.openapi.from_url(f"{contract.url}/openapi.json", config=config)
    broken = []
    for found in described.get_all_operations():
        operation = found.ok()
        try:

            @given(case=operation.as_strategy(generation_mode=mode))
            @GENERATION
            def answers(case: schemathesis.Case) -> None:
                if mode is GenerationMode.POSITIVE:
                    _about(case, run)
                case.call_and_validate(excluded_checks=EXCLUDED)

            answers()
        except Unsatisfiable:
            # There is no wrong request to an operation that takes nothing.
            assert mode is GenerationMode.NEGATIVE
        except (AssertionError, BaseExceptionGroup) as error:
            broken.append(f"{operation.label}: {error}")
    assert not broken, "\n\n".join(broken)


def _about(case: schemathesis.Case, run: str) -> None:
    """Ask about a run that is there instead of any."""
    if case.path.startswith("/v1/runs/{id}") and case.method != "DELETE":
        case.path_parameters["id"] = run
        if case.path.endswith("{name}.{form}"):
            case.path_parameters["name"] = "energy"
    if case.path == "/v1/compare":
        case.query.update(a=run, b=run)
    if case.path.startswith("/v1/models/"):
        case.path_parameters["name"] = "mkz49"
