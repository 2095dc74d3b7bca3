"""Why a renderer ended names the settings of OpenGL that are set."""

import pytest

from harness.report.kit.render_process import _OPENGL_VARIABLES, describe_exit


def test_the_reason_names_settings_of_opengl(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in _OPENGL_VARIABLES:
        monkeypatch.delenv(name, raising=False)
    assert describe_exit(1, "text\nno window\n") == "the renderer failed (no window)"
    monkeypatch.setenv("VTK_DEFAULT_OPENGL_WINDOW", "foo")
    assert describe_exit(1, "") == "the renderer failed where VTK_DEFAULT_OPENGL_WINDOW=foo is set (exit code 1)"
    assert describe_exit(-11, "").startswith(
        "the renderer was killed by SIGSEGV where VTK_DEFAULT_OPENGL_WINDOW=foo is set;"
    )
