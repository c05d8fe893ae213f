"""Run the `simbrake` command, also by `python -m simbrake`."""

import atexit
import gc
import os
import signal
import sys
import threading


def main(arguments: list[str] | None = None) -> None:
    """Entry point of the `simbrake` command. While it loads, Ctrl-C ends it at once and
    without a traceback."""
    main_thread = threading.current_thread() is threading.main_thread()
    usual = (
        main_thread and signal.getsignal(signal.SIGINT) is signal.default_int_handler
    )
    hook = sys.unraisablehook
    if arguments is None:
        # nearly all that a command makes stays: the collector would walk over all of
        # JAX's objects again and again
        gc.set_threshold(100_000, 20, 50)
        atexit.register(gc.freeze)
        # matrices are small: NumPy's threads would only wait for work, which takes a
        # processor
        os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    try:
        if usual:
            signal.signal(signal.SIGINT, _quit)
            sys.unraisablehook = _raise_again
        from .cli._cli import main as run

        run(arguments)
    except SystemExit as ended:
        if arguments is None and ended.code == 130:
            sys.stdout.flush()
            sys.stderr.flush()
            # a compilation that was interrupted may crash the end of the interpreter
            os._exit(130)
        raise
    finally:
        if usual:
            signal.signal(signal.SIGINT, signal.default_int_handler)
            sys.unraisablehook = hook


def _raise_again(lost: "sys.UnraisableHookArgs") -> None:
    """A Ctrl-C that came in a callback of the garbage collector (JAX has one), where
    Python drops it, comes again."""
    if lost.exc_type is KeyboardInterrupt:
        # (raised here it would be lost as well)
        threading.Timer(0.01, os.kill, (os.getpid(), signal.SIGINT)).start()
    else:
        sys.__unraisablehook__(lost)


def _quit(*_: object) -> None:
    sys.stderr.write("simbrake: interrupted\n")
    # an extension that is interrupted while it loads leaves others broken
    os._exit(130)


if __name__ == "__main__":
    main()
