"""Recordings that Python's packages read, as named columns of float64; and how
tables are written."""

import collections
import csv
import importlib
import io
import os
import tempfile
import zipfile
from typing import Any, Callable, Dict, List, Optional, Tuple, Union

import numpy as np

from ._errors import InputError

Table = Dict[str, np.ndarray]

_PACKAGES = {"pandas": "pandas", "h5py": "hdf5", "pyarrow": "parquet",
             "rosbags": "bags", "mcap": "bags", "torch": "torch"}


def need(package: str) -> Any:
    """An optional package, or what to install for it."""
    try:
        return importlib.import_module(package)
    except ImportError:
        top = package.split(".", maxsplit=1)[0]
        raise InputError(
            package, "is not installed",
            f"pip install 'sysid[{_PACKAGES.get(top, top)}]', or "
            f"pip install {top}") from None


def as_numbers(values: Any) -> Optional[np.ndarray]:
    """float64, missing as NaN; None of what is no numbers. Times as datetimes
    or as whole numbers that float64 has no room for count from the first."""
    values = np.ma.filled(values, np.nan) if np.ma.isMA(values) else values
    array = np.asarray(values)
    if array.dtype.kind in "mM":
        missing = np.isnat(array)
        whole = array.astype("timedelta64[ns]" if array.dtype.kind == "m"
                             else "datetime64[ns]").astype(np.int64)
        known = whole[~missing]
        numbers = (whole - (known[0] if known.size else 0)) / 1e9
        numbers[missing] = np.nan
        return numbers
    if array.dtype.kind in "iu" and array.size and (
            array.max() > 2**53 or array.min() < -2**53):
        array = array - array.flat[0]
    if array.dtype.kind not in "biuf":
        return None
    return array.astype(np.float64, copy=False)


def add_array(name: str, values: Any, table: Table) -> None:
    """Columns of an array: ``name`` of one axis, ``name[:,0]`` and so on of
    two; other arrays are no columns."""
    if getattr(getattr(values, "dtype", None), "names", None):
        for field in values.dtype.names:
            add_array(f"{name}.{field}" if name else field, values[field],
                      table)
        return
    numbers = as_numbers(values)
    if numbers is None or numbers.size == 0:
        return
    if numbers.ndim == 1:
        table[name] = numbers
    elif numbers.ndim == 2 and numbers.shape[1] == 1:
        table[name] = numbers[:, 0]
    elif numbers.ndim == 2:
        for i in range(numbers.shape[1]):
            column = f"{name}[:,{i}]" if name else f"#{i + 1}"
            table[column] = numbers[:, i]


def _of_one_length(path: str, table: Table, notices: List[str]) -> Table:
    """The columns that are as long as the time, or else as most are."""
    if not table:
        raise InputError(path, "has no arrays of numbers",
                         "it needs one of the times and one of a measurement")
    lengths = collections.Counter(len(values) for values in table.values())
    length = lengths.most_common(1)[0][0]
    for name in ("t", "time"):
        if name in table:
            length = len(table[name])
            break
    left_out = [name for name in table if len(table[name]) != length]
    if left_out:
        notices.append(f"{path}: left out, as they have other lengths than "
                       f"{length}: {', '.join(left_out)}")
    return {name: values for name, values in table.items()
            if len(values) == length}


def _read_npz(path: str) -> Table:
    table: Table = {}
    with np.load(path, allow_pickle=False) as arrays:
        for name in arrays.files:
            try:
                add_array(name, arrays[name], table)
            except ValueError:  # objects, which only a pickle has
                continue
    return table


def _read_npy(path: str) -> Table:
    table: Table = {}
    try:
        add_array("", np.load(path, allow_pickle=False), table)
    except ValueError as error:
        raise InputError(path, f"cannot be read: {error}",
                         "save an array of numbers") from None
    if "" in table:
        table["#1"] = table.pop("")
    return table


def _read_torch(path: str) -> Table:
    torch = need("torch")
    loaded = torch.load(path, map_location="cpu", weights_only=True)
    table: Table = {}
    if not isinstance(loaded, dict):
        loaded = {"": loaded}
    for name, tensor in loaded.items():
        if isinstance(tensor, torch.Tensor):
            add_array(str(name), tensor.detach().numpy(), table)
    return table


def _read_hdf5(path: str) -> Table:
    table: Table = {}

    def visit(name: str, of: Any) -> None:
        if hasattr(of, "dtype") and of.ndim in (1, 2):
            add_array(name, of[()], table)

    with need("h5py").File(path, "r") as file:
        file.visititems(visit)
    return table


def add_cells(name: str, cells: List[Any], table: Table) -> None:
    """Columns of cells that are lists: ``name[0]``, ``name[1]``, ..."""
    width = max((len(cell) for cell in cells if cell is not None), default=0)
    for i in range(width):
        numbers = as_numbers(
            [np.nan if cell is None or len(cell) <= i or cell[i] is None
             else cell[i] for cell in cells])
        if numbers is not None:
            table[f"{name}[{i}]"] = numbers


def _read_parquet(path: str) -> Table:
    need("pyarrow")
    read = need("pyarrow.parquet").read_table(path)
    types = need("pyarrow").types
    table: Table = {}
    for name in read.column_names:
        column = read.column(name)
        if types.is_list(column.type) or types.is_fixed_size_list(column.type):
            add_cells(name, column.to_pylist(), table)
        else:
            add_array(name, column.to_numpy(), table)
    return table


def _is_torch(path: str) -> bool:
    with zipfile.ZipFile(path) as archive:
        return any(name.endswith("data.pkl") for name in archive.namelist())


def _read_zip(path: str) -> Table:
    return _read_torch(path) if _is_torch(path) else _read_npz(path)


# What files begin with, and their readers.
_FORMATS: List[Tuple[bytes, Callable[[str], Table]]] = [
    (b"PK\x03\x04", _read_zip),
    (b"\x93NUMPY", _read_npy),
    (b"\x89HDF\r\n", _read_hdf5),
    (b"PAR1", _read_parquet),
]
_BAGS = (b"SQLite format 3\0", b"\x89MCAP")


def split_topic(path: str) -> Tuple[str, str]:
    """``run.mcap:/joint_states``, as file and topic."""
    if not os.path.exists(path):
        file, colon, topic = path.partition(":/")
        if colon and os.path.exists(file):
            return file, "/" + topic
    return path, ""


def _head(path: str) -> bytes:
    try:
        with open(path, "rb") as file:
            return file.read(16)
    except OSError:  # the reader says so
        return b""


def _is_bag(file: str) -> bool:
    if os.path.isdir(file):
        return os.path.exists(os.path.join(file, "metadata.yaml"))
    return _head(file).startswith(_BAGS)


def is_foreign(path: str) -> bool:
    """Whether a file is of a format that is read here, by what it begins with;
    all others are the library's."""
    file, _ = split_topic(path)
    if _is_bag(file):
        return True
    return not os.path.isdir(file) and any(
        _head(file).startswith(begins) for begins, _ in _FORMATS)


def read_table(path: str, wanted: str, notices: List[str]) -> Table:
    """The columns of a file, by name, all of one length. ``wanted`` is the text
    of what is mapped: of a bag it names topics beside that of the joints."""
    file, topic = split_topic(path)
    if _is_bag(file):
        from . import bags

        return bags.read(file, topic, wanted, notices)
    for begins, reader in _FORMATS:
        if _head(file).startswith(begins):
            return _of_one_length(path, reader(file), notices)
    raise InputError(path, "is no format that Python reads here",
                     "sysid.read(path, model) reads all formats")


def make_folder(path: Union[str, "os.PathLike[str]"]) -> None:
    try:
        os.makedirs(path, exist_ok=True)
    except OSError as error:
        raise InputError(os.fspath(path), "no folder can be made there: "
                         f"{error.strerror}", "name another") from None


def write_text(path: Union[str, "os.PathLike[str]"], text: str) -> None:
    """Writes a file whole or not at all."""
    path = os.path.abspath(os.fspath(path))
    try:
        handle, beside = tempfile.mkstemp(dir=os.path.dirname(path),
                                          prefix=".sysid-part-")
        try:
            with open(handle, "w", encoding="utf-8",
                      errors="surrogateescape", newline="") as file:
                file.write(text)
            mask = os.umask(0)
            os.umask(mask)
            os.chmod(beside, 0o666 & ~mask)
            os.replace(beside, path)
        except BaseException:
            os.unlink(beside)
            raise
    except OSError as error:
        raise InputError(path, f"cannot be written: {error.strerror}",
                         "name a file in a folder that is there") from None


def csv_text(table: Table) -> str:
    """Numbers that read back as they are; a missing one is an empty cell."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(table)
    columns = [["" if value != value else repr(value)
                for value in values.tolist()] for values in table.values()]
    text.writelines(",".join(row) + "\n" for row in zip(*columns))
    return text.getvalue()


def write_csv(path: Union[str, "os.PathLike[str]"], table: Table) -> None:
    write_text(path, csv_text(table))
