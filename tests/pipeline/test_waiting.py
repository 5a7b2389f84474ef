import time

from sweeps.process import progress


def test_what_takes_long_is_said_once_and_what_does_not_is_not(monkeypatch, capsys):
    monkeypatch.setattr(progress, "SECONDS_IN_A_LOG", 0.02)
    with progress.announce("looking"):
        time.sleep(0.2)
    assert capsys.readouterr().err == "looking …\n"
    monkeypatch.setattr(progress, "SECONDS_IN_A_LOG", 60.0)
    with progress.announce("looking"):
        pass
    assert capsys.readouterr().err == ""
