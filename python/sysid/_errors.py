class InputError(ValueError):
    """What is wrong with data, names or options, and how to go on.

    >>> import sysid
    >>> try:
    ...     sysid.load("pendulum9")
    ... except sysid.InputError as error:
    ...     print(error.what)
    no shipped model is named 'pendulum9'

    Attributes
    ----------
    place : str
        A file with line and column (``"run.csv:12:3"``), an array with its
        element (``"run 1, joint1.q[12]"``), or an option (``"--free"`` is
        ``free=``).
    what : str
        What is wrong there.
    hint : str
        What to do; may be empty. It names options as the programs' flags.
    """

    def __init__(self, place: str, what: str, hint: str = "") -> None:
        self.place, self.what, self.hint = place, what, hint
        text = f"{place}: {what}"
        super().__init__(text + (f"\n  hint: {hint}" if hint else ""))


class Stopped(RuntimeError):
    """A call was stopped by its event before there was anything to keep."""
