"""A command with a user's tracker runs in a child process, so that a tracker that ends its process is an error.

`os._exit(0)` in a tracker, or `exit` in a library, would end the command with exit code 0 and without output. The
child writes a byte when the command has ended by itself; the parent waits for its end and passes signals on.
"""

from __future__ import annotations

import os
import re
import signal
import socket
import threading
from collections.abc import Callable, Sequence
from contextlib import suppress
from functools import partial
from typing import NoReturn

from scenarios.errors import WorkError
from tracking.app.command_result import print_error

CLASS = re.compile(r"(?:.*=)?(.*\.py|[A-Za-z_][\w.]*):[A-Za-z_]\w*")  # file.py:Class, module:Class
SIGNALS = (signal.SIGINT, signal.SIGTERM, getattr(signal, "SIGHUP", signal.SIGTERM))  # Windows has no SIGHUP


def user_trackers(arguments: Sequence[str]) -> list[str]:
    """Returns the words of a command line that name trackers of users, or for `minimize` a run of one."""
    run_of = list(arguments[1:2]) if arguments[:1] == ["minimize"] else []
    return [word for word in arguments if CLASS.fullmatch(word)] or run_of


def watched(trackers: Sequence[str], as_json: bool) -> Callable[[], object]:
    """Goes on in a child process, in which it returns the function to call when the command has ended. trackers: their
    names, for the message.

    The parent process does not return. It exits with the child's exit code, or with an error line and 1 if the child
    ended otherwise. On systems without sigwaitinfo (macOS, Windows) there is
    no child, and such an end is not noticed.
    """
    if not hasattr(signal, "sigwaitinfo"):
        return lambda: None
    here, there = socket.socketpair()
    before = signal.pthread_sigmask(signal.SIG_BLOCK, (*SIGNALS, signal.SIGCHLD))
    child = os.fork()
    if child:
        there.close()
        _wait(child, here, trackers, as_json)
    here.close()
    signal.pthread_sigmask(signal.SIG_SETMASK, before)
    threading.Thread(target=_exit_with_parent, args=(there,), daemon=True).start()
    return partial(there.sendall, b".")


def _exit_with_parent(there: socket.socket) -> None:
    there.recv(1)
    os._exit(1)


def _wait(child: int, here: socket.socket, trackers: Sequence[str], as_json: bool) -> NoReturn:
    passed_on = set[int]()
    ended, status = 0, 0
    while not ended:
        received = signal.sigwaitinfo((*SIGNALS, signal.SIGCHLD))
        if received.si_signo == signal.SIGCHLD:
            ended, status = os.waitpid(child, os.WNOHANG)
        elif received.si_code <= 0:  # of kill; those of the terminal reach the child, too
            passed_on.add(received.si_signo)
            os.kill(child, received.si_signo)
    code, finished = os.waitstatus_to_exitcode(status), False
    with suppress(BlockingIOError):  # a process that the tracker has left behind holds the socket open
        finished = here.recv(1, socket.MSG_DONTWAIT) == b"."
    if -code in passed_on:
        signal.signal(-code, signal.SIG_DFL)
        signal.pthread_sigmask(signal.SIG_UNBLOCK, SIGNALS)
        os.kill(os.getpid(), -code)
    if not finished:
        how = f"exit code {code}" if code >= 0 else f"signal {-code} ({signal.Signals(-code).name})"
        error = WorkError(
            file=", ".join(trackers), got=f"the end of the process, with {how}", expected="that it goes on",
            remedy="correct the tracker: os._exit, a signal, or a crash of a library; --step-timeout tells the frame",
        )  # fmt: skip
        code = print_error(error, as_json)
    os._exit(code)
