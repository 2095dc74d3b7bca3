"""Draw the contact sheets of this folder: python docs/performer/render.py"""

from pathlib import Path

from contact_sheet import contact_sheet

from harness.mocap import synthetic

# behaviour, performer, take, first figure [s], between figures [s], bone whose heading is the view's
SHEETS = (
    ("walking", "p5", 1, 3.0, 0.1, "thorax"),
    ("boxing", "p2", 1, 4.0, 0.12, "head"),
    ("jumping", "p5", 2, 1.0, 0.1, "thorax"),
    ("golf", "p5", 1, 0.5, 0.22, "head"),
    ("table_tennis", "p2", 2, 7.5, 0.15, "head"),
)


def main() -> None:
    for behaviour, who, take, start_s, every_s, faces in SHEETS:
        clip = synthetic.generate(behaviour, who, take, seed=7)
        title = f"{behaviour.replace('_', ' ')}: built-in performer {who}, take {take}, seed 7"
        path = Path(__file__).parent / f"{behaviour}.png"
        contact_sheet(clip, path, start_s=start_s, every_s=every_s, rows=2, title=title, faces=faces)


if __name__ == "__main__":
    main()
