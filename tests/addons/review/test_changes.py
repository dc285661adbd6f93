"""What a reviewer reads of two plans, and whether rights grew."""

from __future__ import annotations

import copy

from enclave_addons.review.changes import changes
from enclave_addons.review.verb.diff import changes_document, changes_markdown, changes_text
from tests.addons.review.conftest import ROBOT, plan


def test_equal_plans_differ_in_nothing() -> None:
    same = changes(plan(ROBOT), plan(ROBOT))
    assert same.is_empty and not same.rights_grew
    assert changes_text(same) == "no enclave, node, permission or flow differs\n"


def test_a_permission_that_is_added_grows_rights_and_opens_a_flow() -> None:
    after = copy.deepcopy(ROBOT)
    after["/camera"]["/camera/driver"]["publish"] = ["/image", "/plan"]
    after["/logger"]["/logger"]["subscribe"] = ["/image", "/odom", "/plan"]
    grown = changes(plan(ROBOT), plan(after))
    assert grown.rights_grew
    assert changes_text(grown) == (
        "  enclave /camera\n+   publish /plan\n  enclave /logger\n+   subscribe /plan\n+ flow /planner -> /logger\n"
    )


def test_a_permission_that_is_taken_away_does_not() -> None:
    before = copy.deepcopy(ROBOT)
    after = copy.deepcopy(ROBOT)
    del after["/planner"]["/planner"]["call_actions"]
    shrunk = changes(plan(before), plan(after))
    assert not shrunk.rights_grew
    assert changes_text(shrunk) == (
        "  enclave /planner\n-   call actions /drive\n- flow /base -> /planner\n- flow /planner -> /base\n"
    )


def test_a_node_that_moves_is_told_as_that() -> None:
    after = {
        "/camera": {**ROBOT["/camera"], "/logger": ROBOT["/logger"]["/logger"]},
        "/planner": ROBOT["/planner"],
        "/base": ROBOT["/base"],
    }
    moved = changes(plan(ROBOT), plan(after))
    assert moved.rights_grew
    assert [tuple(move) for move in moved.moved] == [("/logger", "/logger", "/camera")]
    assert moved.nodes_added == moved.nodes_removed == ()


def test_what_every_node_has_is_counted_not_listed() -> None:
    after = {**ROBOT, "/new": {"/new": {"publish": ["/x"]}}}
    text = changes_text(changes(plan(ROBOT), plan(after)))
    assert text == "+ node /new\n+ enclave /new\n+   publish /x\n+   and 2 that every node has\n"


def test_the_three_forms_say_the_same() -> None:
    grown = changes(plan(ROBOT), plan({**ROBOT, "/new": {"/new": {"publish": ["/x"]}}}))
    assert changes_markdown(grown).startswith(
        "### Security review\n\n**Rights grew.**\n\n```diff\n+ node /new\n"
    )
    told = changes_document(grown)
    assert told["rights_grew"] is True
    assert told["enclaves"] == [
        {
            "enclave": "/new",
            "new": True,
            "gone": False,
            "added": [
                {"operation": "publish", "name": "/rosout"},
                {"operation": "publish", "name": "/x"},
                {"operation": "subscribe", "name": "/parameter_events"},
            ],
            "removed": [],
        }
    ]
