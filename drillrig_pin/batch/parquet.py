"""Tables of studies as files: read within bounds that are known before, and as CSV that no spreadsheet runs."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from drillrig_pin.escaping import cell

if TYPE_CHECKING:
    import pyarrow

#: Rows and columns of a table, cells of it, and characters of all its words.
MAX_ROWS, MAX_COLUMNS, MAX_CELLS, MAX_LETTERS = 1_000_000, 20_000, 50_000_000, 500_000_000
#: What a file may declare [bytes]: as much as this, or as many times its own size.
LEAST, TIMES = 100_000_000, 200


def read_bounded(path: Path) -> pyarrow.Table:
    """A table of plain columns: numbers, words, truth values.

    Raises:
        ValueError: it declares more than a study has, or far more than its own size, or columns of another kind.
        OSError, pyarrow.ArrowException: it cannot be read.
    """
    import pyarrow
    from pyarrow import parquet, types

    size = path.stat().st_size
    with parquet.ParquetFile(path) as file:
        about, schema = file.metadata, file.schema_arrow
        groups = [about.row_group(i) for i in range(about.num_row_groups)]
        rows, columns = sum(group.num_rows for group in groups), about.num_columns
        if max(rows, about.num_rows) > MAX_ROWS or columns > MAX_COLUMNS or rows * columns > MAX_CELLS:
            raise ValueError(f"it declares {rows} rows of {columns} columns")
        declared = sum(group.column(i).total_uncompressed_size for group in groups for i in range(columns))
        if declared > max(LEAST, TIMES * size):
            raise ValueError(f"its {size / 1e6:.3g} MB declare {declared / 1e6:.3g} MB")
        for field in schema:
            kind = field.type
            plain = (types.is_integer, types.is_floating, types.is_boolean, types.is_string, types.is_null)
            if not any(check(kind) for check in plain):
                raise ValueError(f"the column {field.name!r} holds {kind}")
    # Words are read as numbers of the few that are different: a million of them may be one long text of the file.
    named = [field.name for field in schema if types.is_string(field.type)]
    table = parquet.read_table(path, read_dictionary=named, partitioning=None)
    letters = sum(_letters(table[name]) for name in named)
    if letters > MAX_LETTERS:
        raise ValueError(f"its words have {letters} characters")
    return table.cast(pyarrow.schema(schema, metadata=table.schema.metadata))


def _letters(column: Any) -> int:
    import pyarrow
    from pyarrow import compute

    letters = 0
    for part in column.chunks:
        if isinstance(part, pyarrow.DictionaryArray):
            part = compute.take(compute.binary_length(part.dictionary), part.indices)
        else:
            part = compute.binary_length(part)
        letters += compute.sum(part).as_py() or 0
    return letters


def for_spreadsheets(table: pyarrow.Table) -> pyarrow.Table:
    """The table with an apostrophe before every name and word that a spreadsheet would run as a formula."""
    import pyarrow
    from pyarrow import types

    columns = [
        pyarrow.array([None if word is None else cell(word) for word in column.to_pylist()], pyarrow.string())
        if types.is_string(column.type)
        else column
        for column in table.columns
    ]
    return pyarrow.table(columns, names=[cell(name) for name in table.column_names])
