"""Models a server offers: its own library, whose xacro it trusts, and uploads, which are plain text to it."""

from __future__ import annotations

import contextlib
import math
import re
import threading
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any

from drillrig_pin.batch.cases import model_fingerprint
from drillrig_pin.errors import DrillrigError, ModelError, legal_names, shown
from drillrig_pin.files import MODEL_SUFFIXES, shipped_models
from drillrig_pin.model.modelfile import ModelFile, Parameter, read_model, read_model_text
from drillrig_pin.model.ranges import Range, read_ranges
from drillrig_pin.service.problems import ServiceError
from drillrig_pin.service.records import Records

UPLOAD = "upload:"
NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9_-]{0,63}")
#: What an argument that is a word may be. Nothing in it can be an expression, which xacro would carry out.
WORD = re.compile(r"[A-Za-z][A-Za-z0-9_-]{0,63}")
LARGEST = 1e100


@dataclass(frozen=True)
class Entry:
    """One model.

    Attributes:
        name: as clients say it.
        path: what a worker expands; empty for an upload.
        text: of an upload; empty for a model of the library.
        fingerprint: changes with every file the model is made of.
        file: the model with its default numbers.
        ranges: between which values a number makes sense, of those of which it is known.
    """

    name: str
    path: str
    text: str
    fingerprint: str
    file: ModelFile
    ranges: Mapping[str, Range] = field(default_factory=dict)

    @cached_property
    def parameters(self) -> dict[str, Parameter]:
        """Its numbers and words by name."""
        return self.file.parameters()

    def is_word(self, name: str) -> bool:
        """Whether an argument takes a word instead of a number."""
        row = self.parameters.get(name)
        return row is not None and row.unit == "word"

    def require(self, arguments: Mapping[str, Any]) -> None:
        """Raise ModelError unless all arguments are declared, and finite numbers, or words where words are meant."""
        for name, value in arguments.items():
            error = self._wrong(name, value)
            if error is not None:
                error.field = f"arguments.{name}"
                raise error

    def _wrong(self, name: str, value: Any) -> ModelError | None:
        if name not in self.file.declared:
            return ModelError(
                f"the model has no argument {shown(name)}",
                where=self.name,
                todo=legal_names(name, self.file.declared, "arguments"),
            )
        number = isinstance(value, int | float) and not isinstance(value, bool)
        if self.is_word(name):
            if isinstance(value, str) and WORD.fullmatch(value):
                return None
            return ModelError(f"argument {name} = {shown(value)} is not a word", where=self.name)
        if number and math.isfinite(value) and abs(value) <= LARGEST:
            return None
        return ModelError(f"argument {name} = {shown(value)} is not a finite number", where=self.name)


class Library:
    """All models by name.

    Args:
        records: where uploads are kept.
        folder: models beside the shipped ones; None: none.
    """

    def __init__(self, records: Records, folder: Path | None = None) -> None:
        self.records, self.folder = records, folder
        self._lock = threading.Lock()
        self._entries: dict[str, Entry] = {}

    def paths(self) -> dict[str, Path]:
        """Files of the library by name; a model of one's own hides a shipped one."""
        found = dict(shipped_models())
        if self.folder is not None:
            for suffix in reversed(MODEL_SUFFIXES):
                for path in sorted(self.folder.glob(f"*{suffix}")):
                    name = path.name.removesuffix(suffix)
                    if NAME.fullmatch(name):
                        found[name] = path
        return found

    def warm_up(self) -> None:
        """Read all models ahead of the first question; what is wrong with one is said when it is asked for."""
        for name in self.paths():
            with contextlib.suppress(DrillrigError):
                self.entry(name)

    def entry(self, name: str) -> Entry:
        """A model of the library, or an upload as ``upload:ID``.

        Raises:
            ServiceError: 404, there is none of that name.
            ModelError: its files cannot be read.
        """
        if name.startswith(UPLOAD):
            return self._upload(name)
        paths = self.paths()
        if name not in paths:
            raise ServiceError(
                404, f"no model named {shown(name)}", todo=legal_names(name, paths, "models"), field="model"
            )
        path = paths[name]
        fingerprint = model_fingerprint(str(path))
        # Reading takes a while; whoever asks meanwhile waits for the one who reads.
        with self._lock:
            known = self._entries.get(name)
            if known is None or known.fingerprint != fingerprint:
                # A shipped model is known by its name wherever the worker is.
                place = name if shipped_models().get(name) == path else str(path.absolute())
                known = self._entries[name] = Entry(name, place, "", fingerprint, read_model(path), read_ranges(path))
        return known

    def _upload(self, name: str) -> Entry:
        number = name.removeprefix(UPLOAD)
        known = self._entries.get(name)
        found = self.records.upload(number)
        if found is None:
            self._entries.pop(name, None)
            raise ServiceError(404, f"no upload {shown(number)}", todo="It may have been deleted.", field="model")
        if known is None:
            text = found["content"]
            known = self._entries[name] = Entry(name, "", text, number, read_model_text(text, found["name"]))
        return known
