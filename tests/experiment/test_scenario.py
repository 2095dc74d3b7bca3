"""Scenarios: what is shipped loads, what is wrong is named."""

from dataclasses import dataclass, field
from pathlib import Path

import pytest

from harness.core.fields import replace_fields
from harness.core.split import ClipPart
from harness.errors import BadFile, BadInput, HarnessError, RenamedKey, UnknownName
from harness.experiment.scenarios.motion_source import expand_clips
from harness.experiment.scenarios.scenario import Station
from harness.experiment.scenarios.scenario_reader import load_scenario, shipped_scenarios
from harness.results import varied_text
from harness.simulate import Echo, LostStation, noise_preset

MINIMAL = """
methods = ["ik"]
[motion]
source = "builtin"
behaviours = ["walking"]
test = ["walking_p1_01"]
[stations]
head = { bone = "head" }
"""


def written(folder: Path, text: str) -> Path:
    path = folder / "mine.toml"
    path.write_text(text)
    return path


@pytest.mark.parametrize("path", shipped_scenarios(), ids=lambda path: path.stem)
def test_every_shipped_scenario_loads(path: Path) -> None:
    scenario = load_scenario(path)
    assert scenario.name == path.stem
    assert scenario == load_scenario(path.stem)
    for text in scenario.motion.test:
        ClipPart.parse(text)


def test_there_is_one_for_each_behaviour_and_the_demo() -> None:
    assert {"demo", "walking", "boxing", "jumping", "golf", "table_tennis"} <= {p.stem for p in shipped_scenarios()}


@pytest.mark.parametrize("name", ["boxing", "walking", "jumping", "boxing_inputs"])
def test_the_tables_expect_the_order_of_the_first_paper(name: str) -> None:
    assert load_scenario(name).expected_order[0].methods == ("dynamic_map", "local_pca", "ik")


@pytest.mark.parametrize("name", ["sparse_walking", "sparse_table_tennis"])
def test_the_sparse_databases_expect_the_order_of_the_second_paper(name: str) -> None:
    assert load_scenario(name).expected_order[0].methods == ("kernel_cca", "weighted_blend", "ik")


def test_a_minimal_scenario_takes_its_name_from_the_file(tmp_path: Path) -> None:
    scenario = load_scenario(written(tmp_path, MINIMAL))
    assert (scenario.name, scenario.noise, scenario.stations["head"].bone) == ("mine", "default", "head")


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ('methods = ["ik"]', 'metods = ["ik"]', "methods"),
        ("behaviours =", "behaviors =", "behaviours"),
        ('"builtin"', '"built-in"', "builtin"),
        ('bone = "head"', 'bone = "head", allong = 0.5', "along"),
        ('bone = "head"', 'bone = "head", along = 1.5', "0 to 1"),
        ('bone = "head"', 'bone = "head", along = "0.5"', "expected a number"),
        ('methods = ["ik"]', 'methods = "ik"', "methods: expected a list of texts, such as [\"ik\"], found 'ik'. See"),
        ("[stations]", "[tracker]\noverload = 'yes'\n[stations]", "overload: expected true or false, found 'yes'. See"),
        ('methods = ["ik"]', "methods = []", "no methods"),
        ('methods = ["ik"]', 'methods = ["ik", "ik"]', "twice"),
        ('methods = ["ik"]', 'methods = ["ik"]\nseed = true', "expected a whole number"),
        ('methods = ["ik"]', 'methods = ["ik"]\nschema = 2', "schema"),
        ('["walking"]', '["walking", "boxing"]', "behaviours"),
        ('["walking_p1_01"]', "[]", "no test clips"),
        ("[stations]", "[tracker]\nrate_hz = 2000.0\n[stations]", "1 to 1000"),
        ("[stations]", "[tracker]\nrate_hz = 0.0\n[stations]", "from 1 to 1000"),
        ("[motion]", "[motion", "not TOML"),
        ('methods = ["ik"]', 'methods = ["ik"]\ninputs = []', "no inputs"),
        ('methods = ["ik"]', 'methods = ["ik"]\ninputs = ["pos", "pos"]', "twice"),
        ('methods = ["ik"]', 'methods = ["ik"]\nname = "../other"', "plain name"),
        ("[motion]", "[motion]\nlongest_s = -1.0", "from 0 to 100000"),
        ("[motion]", "[motion]\nlongest_s = nan", "finite"),
        ('bone = "head"', 'bone = "head", around_deg = inf', "finite"),
        ('bone = "head"', 'bone = "head", stand_off_m = -0.1', "from 0 to 0.5"),
        ('methods = ["ik"]', 'methods = ["ik"]\nworn = ["haed"]', "'haed'"),
        ('methods = ["ik"]', 'methods = ["ik"]\nworn = ["head", "head"]', "twice"),
    ],
)
def test_what_is_wrong_is_named(tmp_path: Path, old: str, new: str, message: str) -> None:
    assert old in MINIMAL
    with pytest.raises(HarnessError) as caught:
        load_scenario(written(tmp_path, MINIMAL.replace(old, new)))
    assert message in str(caught.value)


ORDER = """
[[expected_order]]
source = "a paper"
methods = ["mean_pose", "ik[loss.robust=false]", "ik"]
why_not = { "mean_pose > ik[loss.robust=false]" = "because" }
[[expected_order]]
source = "another paper"
method = "ik"
inputs = ["pos+ori", "pos"]
"""
ORDERED = MINIMAL.replace(
    '["ik"]', '["ik", "mean_pose", "ik[loss.robust=true|false]"]\ninputs = ["pos", "pos+ori"]'
).replace("[motion]", ORDER + "[motion]")


def test_orders_are_of_what_is_run(tmp_path: Path) -> None:
    of_methods, of_inputs = load_scenario(written(tmp_path, ORDERED)).expected_order
    assert of_methods.names == ("mean_pose", "ik[loss.robust=false]", "ik")
    assert of_methods.steps == ["mean_pose > ik[loss.robust=false]", "ik[loss.robust=false] > ik"]
    assert (of_inputs.names, of_inputs.by, of_inputs.method) == (("pos+ori", "pos"), "inputs", "ik")


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ('source = "a paper"', "", "missing source"),
        ('source = "a paper"', 'source = ""', "has no source"),
        ('methods = ["mean_pose", "ik[loss.robust=false]", "ik"]', "", "neither or both"),
        ('method = "ik"', 'method = "ik"\nmethods = ["mean_pose", "ik"]', "neither or both"),
        ('source = "a paper"', 'source = "a paper"\nmethod = "ik"', "whose inputs it does not compare"),
        ('method = "ik"', "", "'', none of the scenario's methods"),
        ('method = "ik"', 'method = "mean_poze"', "'mean_poze', none of the scenario's methods"),
        ('"mean_pose", "ik[loss.robust=false]", "ik"]', '"mean_pose"]', "fewer than two"),
        ('"ik[loss.robust=false]", "ik"]', '"kernel_cca", "ik"]', "'kernel_cca', none of the scenario's methods"),
        ('"ik[loss.robust=false]", "ik"]', '"ik", "mean_pose"]', "twice"),
        ('["pos+ori", "pos"]\n[motion]', '["pos+ori", "mixed"]\n[motion]', "'mixed', none of the scenario's inputs"),
        ('"mean_pose > ik[', '"ik > ik[', "does not have"),
        ("why_not =", "why =", "Did you mean 'why_not'"),
    ],
)
def test_what_is_wrong_with_an_order_is_named(tmp_path: Path, old: str, new: str, message: str) -> None:
    assert ORDERED.count(old) == 1
    with pytest.raises(HarnessError) as caught:
        load_scenario(written(tmp_path, ORDERED.replace(old, new)))
    assert message in str(caught.value)


def test_a_scenario_that_does_not_exist_is_refused(tmp_path: Path) -> None:
    with pytest.raises(UnknownName, match="Did you mean 'boxing'"):
        load_scenario("boxin")
    with pytest.raises(BadFile, match="no such file"):
        load_scenario(tmp_path / "none.toml")


def test_a_binary_file_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "binary.toml"
    path.write_bytes(bytes(range(256)))
    with pytest.raises(BadFile, match="binary data; expected a scenario"):
        load_scenario(path)


@dataclass(frozen=True)
class _Inner:
    share: float = 0.03


@dataclass(frozen=True)
class _Outer:
    echo: _Inner = field(default_factory=_Inner)
    rate_hz: float = 40.0


def test_single_values_of_a_record_can_be_changed() -> None:
    assert replace_fields(_Outer(), {"echo": {"share": 0.1}}, "components") == _Outer(_Inner(0.1))
    assert replace_fields(_Outer(), {"rate_hz": 60}, "tracker").rate_hz == 60.0
    with pytest.raises(UnknownName, match="share"):
        replace_fields(_Outer(), {"echo": {"shar": 0.1}}, "components")


def test_noise_components_are_changed_added_and_listed() -> None:
    assert replace_fields(noise_preset("default"), {"echo": {"share": 0.1}}, "components").echo == Echo(share=0.1)
    assert replace_fields(noise_preset("clean"), {"echo": {"share": 0.1}}, "components").echo == Echo(share=0.1)
    lost = [{"station": "head", "from_s": 1.0, "to_s": 2.0}]
    assert replace_fields(noise_preset("clean"), {"lost": lost}, "components").lost == (LostStation("head", 1.0, 2.0),)


VARIED = """
[vary]
noise = ["clean", "default"]
components.echo.share = [0.0, 0.05]
"stations.head.along" = [0.5]
"""


def test_every_combination_of_varied_values_is_a_scenario(tmp_path: Path) -> None:
    scenario = load_scenario(written(tmp_path, MINIMAL + "[components.echo]\nsize_m = [0.1, 0.2]\n" + VARIED))
    found = scenario.variants()
    assert [list(varied.values()) for varied, _ in found] == [
        ["clean", 0.0, 0.5], ["clean", 0.05, 0.5], ["default", 0.0, 0.5], ["default", 0.05, 0.5],
    ]  # fmt: skip
    assert list(found[0][0]) == ["noise", "components.echo.share", "stations.head.along"]
    last = found[-1][1]
    assert (last.noise, last.stations["head"]) == ("default", Station("head", along=0.5))
    assert last.components == {"echo": {"size_m": [0.1, 0.2], "share": 0.05}}
    assert last.vary == {}
    assert last.variants() == [({}, last)]
    assert [scenario.count_variants(), last.count_variants()] == [4, 1]


def test_what_is_worn_is_taken_from_the_stations_in_their_order(tmp_path: Path) -> None:
    two = MINIMAL + 'torso = { bone = "thorax" }\n'
    scenario = load_scenario(written(tmp_path, two + "[vary]\nworn = [[], ['torso'], ['torso', 'head']]\n"))
    found = {varied_text(varied): tuple(made.worn_stations) for varied, made in scenario.variants()}
    assert found == {"worn=[]": ("head", "torso"), "worn=torso": ("torso",), "worn=torso+head": ("head", "torso")}


def test_a_component_can_be_varied_away(tmp_path: Path) -> None:
    scenario = load_scenario(written(tmp_path, MINIMAL + '[vary]\n"components.echo" = ["none", { share = 0.1 }]\n'))
    without, with_it = (
        replace_fields(noise_preset("default"), made.components, "components") for _, made in scenario.variants()
    )
    assert without.echo is None
    assert with_it.echo == Echo(share=0.1)


@pytest.mark.parametrize(
    ("line", "message"),
    [
        ("seed = 3", "not a list"),
        ("seed = []", "not a list"),
        ("seed = [1, 1]", "not a list"),
        ("seed = [1, 1.5]", "expected a whole number"),
        ("sed = [1, 2]", "Did you mean 'seed'"),
        ("tracker.rate = [1.0, 2.0]", "Did you mean 'rate_hz'"),
        ("tracker.rate_hz = [40.0, 4000.0]", "tracker.rate_hz = 4000"),
        ("motion.test = [['a']]", "cannot be varied"),
        ("methods = [['ik'], ['mean_pose']]", "cannot be varied"),
        ("noise = ['clean', 'loud']", "loud"),
        ("worn = [['head'], ['torso']]", "'torso' with worn=torso"),
        ("worn = ['head']", "expected a list"),
    ],
)
def test_what_cannot_be_varied_is_refused(tmp_path: Path, line: str, message: str) -> None:
    with pytest.raises(HarnessError, match=message):
        load_scenario(written(tmp_path, MINIMAL + f"[vary]\n{line}\n"))


def test_alternatives_of_a_method_are_methods(tmp_path: Path) -> None:
    scenario = load_scenario(written(tmp_path, MINIMAL.replace('"ik"', '"ik[limits=true|false]", "ik"')))
    assert scenario.methods == ("ik[limits=true]", "ik[limits=false]", "ik")


def with_stations(folder: Path, stations: str) -> dict[str, Station]:
    text = MINIMAL.replace('[stations]\nhead = { bone = "head" }\n', stations)
    return load_scenario(written(folder, text)).stations


def test_a_scenario_names_a_set_of_stations(tmp_path: Path) -> None:
    path = written(tmp_path, 'stations = "kim2012"' + MINIMAL.replace('[stations]\nhead = { bone = "head" }\n', ""))
    assert list(load_scenario(path).stations) == ["right_hand", "left_hand", "right_ankle", "left_ankle", "pelvis"]
    assert load_scenario(path).stations["pelvis"] == Station("lhipjoint", along=0.0, around_deg=165.0)


def test_a_set_of_stations_is_changed_station_by_station(tmp_path: Path) -> None:
    stations = with_stations(
        tmp_path,
        '[stations]\nset = "liu2011"\ntorso = "none"\nhead = { along = 0.5 }\n'
        'pelvis = { bone = "lhipjoint", along = 0.0 }\n',
    )
    assert list(stations) == ["left_hand", "right_hand", "left_ankle", "right_ankle", "head", "pelvis"]
    assert stations["head"] == Station("head", along=0.5)
    assert stations["left_hand"] == load_scenario("demo").stations["left_hand"]


@pytest.mark.parametrize(
    ("stations", "message"),
    [
        ('[stations]\nset = "liu201"\n', "Did you mean 'liu2011'"),
        ('[stations]\nset = "liu2011"\npelvis = "none"\n', "no station of liu2011 called 'pelvis'"),
        ('[stations]\nset = "liu2011"\nhead = { allong = 0.5 }\n', "along"),
        ('[stations]\nset = "liu2011"\nhead = 3\n', "expected a table"),
    ],
)
def test_what_is_wrong_with_a_set_of_stations_is_named(tmp_path: Path, stations: str, message: str) -> None:
    with pytest.raises(HarnessError, match=message):
        with_stations(tmp_path, stations)


@pytest.mark.parametrize(
    ("old", "new", "key"),
    [("[motion]", '[motion]\nprotocol = "block"', "split"), ("[motion]", "order = []\n[motion]", "expected_order")],
)
def test_an_old_key_is_refused_with_its_new_name(tmp_path: Path, old: str, new: str, key: str) -> None:
    with pytest.raises(RenamedKey, match=f"now called {key!r}"):
        load_scenario(written(tmp_path, MINIMAL.replace(old, new)))


def test_patterns_in_clip_lists_stand_for_the_clips_that_match(tmp_path: Path) -> None:
    text = MINIMAL.replace('["walking_p1_01"]', '["boxing_p2_02", "walking_p1_0[12]@0.20-0.40", "boxing_p2_*"]')
    scenario = load_scenario(written(tmp_path, text))
    motion = expand_clips(scenario, None).motion
    boxing = [f"boxing_p2_{number:02}" for number in (1, 3, 4, 5, 6)]
    assert list(motion.test[:3]) == ["boxing_p2_02", "walking_p1_01@0.20-0.40", "walking_p1_02@0.20-0.40"]
    assert list(motion.test[3:]) == boxing
    assert expand_clips(load_scenario("demo"), None) == load_scenario("demo")


def test_too_many_combinations_are_refused_before_they_are_listed(tmp_path: Path) -> None:
    keys = ("tracker.latency_s", "tracker.baud", "tracker.queue_records", "seed", "tracker.rate_hz")
    table = "".join(f'"{key}" = {list(range(10, 40))}\n' for key in keys)
    with pytest.raises(HarnessError, match="24,300,000 combinations"):
        load_scenario(written(tmp_path, f"{MINIMAL}[vary]\n{table}")).variants()


def test_a_pattern_matches_clips_that_are_named_by_their_path(tmp_path: Path) -> None:
    for name, frames in (("Anna/take_001", 3), ("Bert/take_001", 4), ("Bert/take_002", 3)):
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / f"{name}.bvh").write_text(str(frames))
    text = MINIMAL.replace('"builtin"', '"cmu"').replace("walking_p1_01", "take_*")
    motion = expand_clips(load_scenario(written(tmp_path, text)), tmp_path).motion
    assert motion.test == ("Anna/take_001", "Bert/take_001", "take_002")


def test_a_pattern_that_matches_nothing_is_refused(tmp_path: Path) -> None:
    scenario = load_scenario(written(tmp_path, MINIMAL.replace("walking_p1_01", "walking_p99_*")))
    with pytest.raises(BadInput, match=r"motion\.test: no clip matches 'walking_p99_\*'"):
        expand_clips(scenario, None)


def test_behaviours_are_counted_when_patterns_are_expanded(tmp_path: Path) -> None:
    text = MINIMAL.replace("walking_p1_01", "walking_p1_*").replace('["walking"]', '["walking", "boxing"]')
    with pytest.raises(BadFile, match="2 behaviours for 6 test clips"):
        expand_clips(load_scenario(written(tmp_path, text)), None)


@pytest.mark.parametrize(
    ("parts", "overlaps"),
    [
        (("13_17@0.40-0.60", "13_17@0.50-0.70"), True),
        (("13_17@0.40-0.60", "13_17"), True),
        (("13_*@0.40-0.60", "13_*@0.10-0.45"), True),
        (("13_17@0.40-0.60", "13_17@0.60-0.70"), False),
        (("13_17@0.40-0.60", "13_30@0.50-0.70"), False),
    ],
)
def test_test_parts_of_one_take_do_not_overlap(tmp_path: Path, parts: tuple[str, str], overlaps: bool) -> None:
    text = MINIMAL.replace('["walking_p1_01"]', f'["{parts[0]}", "{parts[1]}"]').replace("builtin", "cmu")
    if overlaps:
        with pytest.raises(BadFile, match="overlap"):
            load_scenario(written(tmp_path, text))
    else:
        assert load_scenario(written(tmp_path, text)).motion.test == parts


def test_a_pattern_and_a_clip_do_not_overlap_once_it_is_expanded(tmp_path: Path) -> None:
    text = MINIMAL.replace('["walking_p1_01"]', '["walking_p1_0*@0.40-0.60", "walking_p1_02@0.50-0.70"]')
    with pytest.raises(BadFile, match=r"walking_p1_02@0\.40-0\.60 and walking_p1_02@0\.50-0\.70, which overlap"):
        expand_clips(load_scenario(written(tmp_path, text)), None)
