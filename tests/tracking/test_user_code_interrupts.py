"""Ctrl-C that Python loses in a destructor still ends a command with 130."""

import signal

import pytest

from tests.tracking.test_user_code import command
from tracking.app.cli import run
from tracking.user_code import raise_if_interrupted, recorded_interrupts


@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")
def test_an_interrupt_that_python_loses_ends_the_command(tmp_path, capsys):
    assert run(command(tmp_path, "step", "type('Losing', (), {'__del__': lambda _: signal.raise_signal(2)})()")) == 130
    assert "interrupted" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()
    raise_if_interrupted()  # the record ends with the command
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler


def test_an_interrupt_is_raised_where_it_arrives():
    with pytest.raises(KeyboardInterrupt), recorded_interrupts():
        signal.raise_signal(signal.SIGINT)
    raise_if_interrupted()


def test_a_program_with_its_own_handler_keeps_it():
    def own(number, frame):
        pass

    before = signal.signal(signal.SIGINT, own)
    try:
        with recorded_interrupts():
            assert signal.getsignal(signal.SIGINT) is own
        assert signal.getsignal(signal.SIGINT) is own
    finally:
        signal.signal(signal.SIGINT, before)
