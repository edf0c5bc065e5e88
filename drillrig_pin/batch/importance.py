"""Which parameter matters: indices of a sensitivity study and the file they are kept in.

The file is ``sensitivity.json``, beside ``results.parquet``. One JSON document:

    format      "drillrig sensitivity 1"
    study, text name and text of the study
    method      "morris" or "sobol"
    seed        of the samples and of the bootstrap
    confidence  level of every ``*_conf``, 0.95: the true value lies within value +- conf this often
    over        "worst" or "mean" over the conditions; "" if every design is one case
    conditions  how many cases a design is: holes, and whatever else the study lists
    designs     points of the sampling plan
    blocks      trajectories (Morris) or samples (Sobol) the plan is made of
    failed      designs of which a case has no numbers
    metric      name of the metric the study is about; its indices come first
    parameters  list: name ("model.rock_stiffness"), low, high, scale ("linear", "log"), unit, text, assumed
    indices     list, one entry for every metric and parameter, by metric, most important first:
                metric, unit, parameter, rank (1: most important),
                importance, importance_conf   mu_star of Morris, ST of Sobol: what ranks, whatever the method
                separated       the intervals of this and of the next lower rank do not overlap (null: the last one)
                matters         the interval does not reach zero
                mu_star, mu_star_conf, mu, sigma    Morris only [unit of the metric over the whole range]
                S1, S1_conf, ST, ST_conf            Sobol only [1]
    metrics     list: metric, unit, blocks (used; the others miss a number), mean, least, greatest,
                verdict (a sentence), advised (blocks that would separate what is not; null: none, or too many)
    missing     metrics of which there are no indices, by name, with the reason

``pandas.DataFrame(json.load(open("sensitivity.json"))["indices"])`` is the table.

Morris [Technometrics 33 (1991) 161]: with x_i scaled to 0..1 over its range, d_i = (y(x + delta e_i) - y(x)) / delta
along every trajectory; mu = mean(d_i), mu_star = mean(|d_i|), sigma = std(d_i): overall effect with and without sign,
and how much it depends on where in the box one stands. Sobol: S1 = V(E(y | x_i)) / V(y) and ST = 1 - V(E(y | x_~i)) /
V(y): share of the variance a parameter explains alone, and with everything it acts together with.
"""

from __future__ import annotations

import dataclasses
import json
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal

from pydantic import TypeAdapter

from drillrig_pin.errors import ResultFileError
from drillrig_pin.files import saving
from drillrig_pin.modest import modest_bytes

FILE = "sensitivity.json"
FORMAT = "drillrig sensitivity 1"
MAX_BYTES = 50_000_000

Method = Literal["morris", "sobol"]


@dataclass(frozen=True, slots=True)
class Parameter:
    """What is varied, between which bounds."""

    name: str
    low: float
    high: float
    scale: str = "linear"
    unit: str = ""
    text: str = ""
    assumed: bool = False


@dataclass(frozen=True, slots=True)
class Index:
    """How much one parameter matters to one metric; see the module for the meaning of every field."""

    metric: str
    unit: str
    parameter: str
    rank: int
    importance: float
    importance_conf: float
    separated: bool | None
    matters: bool
    mu_star: float | None = None
    mu_star_conf: float | None = None
    mu: float | None = None
    sigma: float | None = None
    S1: float | None = None
    S1_conf: float | None = None
    ST: float | None = None
    ST_conf: float | None = None


@dataclass(frozen=True, slots=True)
class Analysed:
    """One metric over the whole plan [unit], and whether its ranking can be trusted."""

    metric: str
    unit: str
    blocks: int
    mean: float
    least: float
    greatest: float
    verdict: str
    advised: int | None = None


@dataclass(frozen=True)
class Sensitivity:
    """Result of a sensitivity study; see the module for the meaning of every field."""

    study: str
    text: str
    method: Method
    seed: int
    confidence: float
    over: str
    conditions: int
    designs: int
    blocks: int
    failed: int
    metric: str
    parameters: tuple[Parameter, ...] = field(repr=False)
    indices: tuple[Index, ...] = field(repr=False)
    metrics: tuple[Analysed, ...] = field(repr=False)
    missing: dict[str, str] = field(default_factory=dict, repr=False)

    def of(self, metric: str) -> tuple[Index, ...]:
        """Indices of one metric, most important first."""
        return tuple(index for index in self.indices if index.metric == metric)

    def document(self) -> dict[str, Any]:
        """What the file holds; fields the method does not have are left out."""
        content = {"format": FORMAT, **dataclasses.asdict(self)}
        always = {"separated"}
        content["indices"] = [
            {name: value for name, value in index.items() if value is not None or name in always}
            for index in content["indices"]
        ]
        return content

    def save(self, folder: Path) -> Path:
        """Write the file into the folder of the study; ResultFileError if that cannot be."""
        target = folder / FILE
        text = json.dumps(self.document(), indent=1, ensure_ascii=False, allow_nan=False) + "\n"
        with saving(target, where=target, todo="Make room; the cases themselves are safe.") as aside:
            aside.write_text(text, encoding="utf-8")
        return target


def load_sensitivity(folder: Path) -> Sensitivity:
    """Read the file of a folder back; ResultFileError if there is none or it is not one."""
    target = folder / FILE
    try:
        content = json.loads(modest_bytes(target, MAX_BYTES))
        if content.pop("format") != FORMAT:
            raise ValueError("another format")
        return TypeAdapter(Sensitivity).validate_python(content)
    except OSError as error:
        raise ResultFileError(
            f"cannot be read ({error.strerror})", where=target, todo="Write it with: drillrig sensitivity"
        ) from None
    except (ValueError, TypeError, KeyError, AttributeError, RecursionError) as error:
        raise ResultFileError(
            f"is not the file of a sensitivity study ({' '.join(str(error).split())[:100]})", where=target
        ) from None
