"""Calls of the C interface (python/native/c_interface.h) by ctypes.

ctypes lets other threads of Python run while a call lasts.
"""

import ctypes
import json
import os
import pathlib
import threading

import numpy as np

from ._errors import InputError, Stopped

_DOUBLES = ctypes.POINTER(ctypes.c_double)
_DONE, _INPUT_ERROR, _STOPPED, _NO_MEMORY, _FAILED = range(5)


class _Table(ctypes.Structure):
    _fields_ = [
        ("name", ctypes.c_char_p),
        ("rows", ctypes.c_size_t),
        ("columns", ctypes.c_size_t),
        ("header", ctypes.POINTER(ctypes.c_char_p)),
        ("values", ctypes.POINTER(_DOUBLES)),
        ("strides", ctypes.POINTER(ctypes.c_ssize_t)),
    ]


def _library_path():
    """SYSID_LIBRARY, or the library that is installed beside this file."""
    named = os.environ.get("SYSID_LIBRARY")
    if named:
        return named
    folder = pathlib.Path(__file__).parent / "lib"
    return str(folder / "libsysid_python.so")


def _load():
    path = _library_path()
    try:
        library = ctypes.CDLL(path)
    except OSError as error:
        raise ImportError(
            f"{error}\n  hint: pip install builds and installs it; "
            "SYSID_LIBRARY names that of a build (docs/python.md)") from None
    pointer, size = ctypes.c_void_p, ctypes.c_size_t
    sizes = ctypes.POINTER(size)

    def declare(name, result, *arguments):
        function = getattr(library, name)
        function.restype, function.argtypes = result, arguments

    declare(
        "sysid_call", pointer, ctypes.c_char_p, ctypes.c_char_p,
        ctypes.POINTER(pointer), size, ctypes.POINTER(_Table), size, pointer)
    declare("sysid_object_code", ctypes.c_int, pointer)
    declare("sysid_object_text", ctypes.c_char_p, pointer)
    declare("sysid_object_arrays", size, pointer)
    declare("sysid_array_name", ctypes.c_char_p, pointer, size)
    declare("sysid_array_values", _DOUBLES, pointer, size, sizes, sizes)
    declare("sysid_object_free", None, pointer)
    declare("sysid_control_new", pointer)
    declare("sysid_control_stop", None, pointer)
    declare(
        "sysid_control_progress", ctypes.c_int, pointer, ctypes.c_char_p, size,
        ctypes.POINTER(ctypes.c_int), ctypes.POINTER(ctypes.c_int),
        ctypes.POINTER(ctypes.c_double))
    declare("sysid_control_free", None, pointer)
    declare("sysid_version", ctypes.c_char_p)
    return library


_library = _load()
version = _library.sysid_version().decode()


class Handle:
    """A result of the library: JSON, arrays, and what later calls ask on."""

    def __init__(self, pointer):
        self.pointer = pointer

    def __del__(self):
        if self.pointer:
            _library.sysid_object_free(self.pointer)
            self.pointer = None

    @property
    def code(self):
        return _library.sysid_object_code(self.pointer)

    def value(self):
        return json.loads(_library.sysid_object_text(self.pointer))

    def arrays(self):
        """Copies of the arrays by name, rows x columns; the caller's own."""
        found = {}
        rows, columns = ctypes.c_size_t(), ctypes.c_size_t()
        for i in range(_library.sysid_object_arrays(self.pointer)):
            name = _library.sysid_array_name(self.pointer, i).decode()
            values = _library.sysid_array_values(
                self.pointer, i, ctypes.byref(rows), ctypes.byref(columns))
            shape = (rows.value, columns.value)
            if 0 in shape:
                found[name] = np.zeros(shape)
            else:
                found[name] = np.ctypeslib.as_array(values, shape).copy()
        return found


class Table:
    """Columns by name as the library takes them: no copy of float64 arrays."""

    def __init__(self, name, columns):
        self.name, self.columns = name, columns

    def fill(self, table):
        arrays = list(self.columns.values())
        count = len(arrays)
        header = (ctypes.c_char_p * count)(
            *(column.encode() for column in self.columns))
        values = (_DOUBLES * count)(
            *(ctypes.cast(a.ctypes.data, _DOUBLES) for a in arrays))
        strides = (ctypes.c_ssize_t * count)(
            *(a.strides[0] // a.itemsize for a in arrays))
        table.name = self.name.encode()
        table.rows = len(arrays[0]) if arrays else 0
        table.columns = count
        table.header, table.values, table.strides = header, values, strides
        return header, values, strides


class Request:
    """What a call takes: plain values, and the objects and tables in them."""

    def __init__(self):
        self.handles, self.tables = [], []

    def object(self, handle):
        self.handles.append(handle)
        return {"object": len(self.handles) - 1}

    def table(self, name, columns):
        self.tables.append(Table(name, columns))
        return {"table": len(self.tables) - 1}


def _raise(handle):
    code = handle.code
    if code == _DONE:
        return
    if code == _INPUT_ERROR:
        value = handle.value()
        raise InputError(value["place"], value["what"], value["hint"])
    if code == _STOPPED:
        raise Stopped("stopped before there was a first point")
    if code == _NO_MEMORY:
        raise MemoryError("sysid: out of memory")
    raise RuntimeError(handle.value()["what"])


def call(function, values, request, control=None):
    """Calls a function of the library in this thread; returns a Handle."""
    objects = (ctypes.c_void_p * len(request.handles))(
        *(handle.pointer for handle in request.handles))
    tables = (_Table * len(request.tables))()
    kept = [t.fill(to) for t, to in zip(request.tables, tables)]
    handle = Handle(_library.sysid_call(
        function.encode(), json.dumps(values).encode(), objects, len(objects),
        tables, len(tables), control))
    del kept
    _raise(handle)
    return handle


class _Watched:
    """A call in a thread of its own, which this one follows and may stop."""

    PERIOD = 0.05  # s, between looks

    def __init__(self, function, values, request):
        self._control = _library.sysid_control_new()
        self._done = threading.Event()
        self._handle = self._error = None
        self._work = (function, values, request)
        self._thread = threading.Thread(target=self._run, daemon=True)

    def _run(self):
        try:
            self._handle = call(*self._work, control=self._control)
        except BaseException as error:  # raised where the call is awaited
            self._error = error
        finally:
            self._done.set()

    def _progress(self, progress):
        doing = ctypes.create_string_buffer(256)
        iteration, of = ctypes.c_int(), ctypes.c_int()
        error = ctypes.c_double()
        if _library.sysid_control_progress(
                self._control, doing, len(doing), ctypes.byref(iteration),
                ctypes.byref(of), ctypes.byref(error)):
            progress(doing.value.decode(errors="replace"), iteration.value,
                     of.value, error.value)

    def _wait(self, progress, stop):
        while not self._done.wait(self.PERIOD):
            if stop is not None and stop.is_set():
                self.stop()
            if progress is not None:
                self._progress(progress)

    def stop(self):
        _library.sysid_control_stop(self._control)

    def run(self, progress, stop):
        self._thread.start()
        interrupt = None
        try:
            self._wait(progress, stop)
        except BaseException as error:
            interrupt = error
            self.stop()
            # Its memory is the call's until that ends: within a second.
            while not self._done.wait(self.PERIOD):
                pass
            if not isinstance(error, KeyboardInterrupt):
                raise
        finally:
            self._thread.join()
            _library.sysid_control_free(self._control)
        if isinstance(interrupt, KeyboardInterrupt) and isinstance(
                self._error, Stopped):
            raise interrupt
        if self._error is not None:
            raise self._error
        return self._handle


def watch(function, values, request, progress=None, stop=None):
    """The same for long work. Ctrl-C, or `stop` (an event that is set in any
    thread), ends it with the best so far; `progress` is called with what is
    done, the iteration, how many there are at most (0: unknown) and the error
    in multiples of the noise.
    """
    return _Watched(function, values, request).run(progress, stop)
