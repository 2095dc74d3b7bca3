"""The scenario `demo` with clips that are long enough to be played over a line."""

from pathlib import Path


def write_long_demo(folder: Path) -> Path:
    """Write the scenario with clips of eight seconds instead of four; returns its path."""
    shipped = Path("scenarios/demo.toml").read_text(encoding="utf-8")
    assert "longest_s = 4.0" in shipped
    path = folder / "demo.toml"
    path.write_text(shipped.replace("longest_s = 4.0", "longest_s = 8.0"), encoding="utf-8")
    return path
