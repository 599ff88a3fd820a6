"""What a film costs on a farm, computed from parts that are made up."""

import dataclasses
import json
import sys
from pathlib import Path

import pytest

sys.path.append(str(Path(__file__).parents[1] / "scripts"))  # at the end: gallery is a package, and a script there

from farm_plan import SMOOTH, Parts, effect_recipe, parts_table, plan, plans_table, served, used

from shutter_addon.core.recipes import recipe_file

PICTURES = 1000
TIMES = {"once": 10, "picture": 2, "picture_thread": 1.5, "join": 1, "join_thread": 0.5}
PLAIN = Parts(smooth=1, window=16, memory=0, source=1, output=10, **TIMES)


def test_each_core_has_a_worker_and_all_are_busy_to_the_end():
    found = plan(PLAIN, PICTURES, nodes=2, cores=2, longest=100)
    assert found.chunk == 84  # three rounds of four chunks, not two rounds of four and one of two
    assert found.hours * 3600 == pytest.approx(3 * (10 + 84 * 2))
    assert found.work * 3600 == pytest.approx(12 * 10 + PICTURES * (2 + 1))
    assert found.anew == pytest.approx(120 / 2120)


def test_more_workers_than_chunks_get_shorter_ones():
    found = plan(PLAIN, PICTURES, nodes=100, cores=4, longest=100)
    assert found.chunk == 3
    assert found.hours * 3600 == pytest.approx(10 + 3 * 2)


def test_the_join_is_as_fast_as_its_longest_thread_however_many_nodes_there_are():
    for nodes in (1, 100):
        assert plan(PLAIN, PICTURES, nodes, cores=16, longest=100).join * 3600 == pytest.approx(PICTURES * 0.5)


def test_the_join_reads_each_picture_twice():
    found = plan(PLAIN, PICTURES, nodes=2, cores=2, longest=100)
    assert found.joined == 2 * PICTURES * 10
    assert found.traffic == pytest.approx(12 * (84 + 15) * 1 + PICTURES * 10)
    assert found.storage == pytest.approx(PICTURES * (1 + 10))


def test_as_many_nodes_as_the_storage_serves_take_what_it_can_give():
    one = plan(PLAIN, PICTURES, nodes=1, cores=1, longest=PLAIN.window * 9)
    draw = one.traffic / (one.hours * 3600)
    assert served(PLAIN, PICTURES, cores=1, network=8e-9 * draw * 5) == pytest.approx(5, rel=0.05)


@pytest.mark.parametrize("smooth", SMOOTH)
def test_what_is_measured_is_a_recipe_of_filmed_frames(smooth):
    options = recipe_file.parse(json.dumps(effect_recipe(16, smooth))).options.at(1)
    assert (options.window, options.step) == (16, smooth)


def test_tables_have_a_cell_for_each_column():
    found = [dataclasses.replace(PLAIN, smooth=smooth) for smooth in SMOOTH]
    for table in (parts_table(found), plans_table(found, PICTURES, [1, 10], cores=16, network=10)):
        head, _line, *rows = table.splitlines()
        assert {row.count("|") for row in rows} == {head.count("|")}
        assert rows[0].startswith("| off |")
        assert rows[-1].startswith("| 8× |")


def test_a_commands_longest_thread_takes_a_part_of_its_time():
    found = used("--help")
    assert 0 < found.thread <= found.total + 0.05
    assert found.memory > 1e6
