"""The page of licences lists every library of the lock, and marks what asks for something in return."""

from __future__ import annotations

from email.message import Message

import licences


def test_every_locked_library_is_listed_in_its_version() -> None:
    assert len(licences.locked()) > 100
    assert not licences.missing()


def test_copyleft_is_marked() -> None:
    rows = {row.split(" | ")[0]: row for row in licences.PAGE.read_text(encoding="utf-8").splitlines()}
    assert "**copyleft**" in rows["| pebble"]
    assert "**copyleft**" not in rows["| numpy"]


def test_a_licence_is_read_wherever_metadata_states_it() -> None:
    found = Message()
    assert licences.licence_of(found) == "not stated"
    assert licences.licence_of(found, "Permission is hereby granted, free of charge") == "MIT, by its text"
    found["License"] = "BSD"
    assert licences.licence_of(found) == "BSD"
    found["Classifier"] = "License :: OSI Approved :: ISC License (ISCL)"
    assert licences.licence_of(found) == "ISC License (ISCL)"
    found["License-Expression"] = "MPL-2.0"
    assert licences.COPYLEFT.search(licences.licence_of(found))
