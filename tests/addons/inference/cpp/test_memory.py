"""A call is not run again while all that it read is as it was, and is run again as soon as anything of it is not."""

from __future__ import annotations

from pathlib import Path

import pytest

from enclave_addons.inference.cpp.running.memory import AbstractStore, CallOutcome, Memory
from enclave_addons.inference.cpp.running.values import Notes, Value, literal
from tests.addons.inference.cpp.workspace import gaps, in_class, infer, names

pytest.importorskip("tree_sitter_cpp", reason="the extra cpp is not installed")


class Called:
    """A function that writes what it reads in ``topic`` and in a note to ``name``."""

    def __init__(self) -> None:
        self.store = AbstractStore()
        self.memory = Memory(self.store)
        self.notes = Notes(self.store.log)
        self.runs = 0
        self.store.set(("object", "topic"), literal("a"))
        self.notes["default"] = "b"

    def __call__(self, given: object = None) -> Value:
        known = self.memory.find("call", given)
        outcome = known[0] if known is not None else self.memory.keep("call", given, self._run)
        return outcome.returned

    def _run(self) -> tuple[CallOutcome, int]:
        self.runs += 1
        found = (*(self.store.get(("object", "topic")) or ()), *literal(self.notes["default"]))
        self.store.set(("object", "name"), found)
        return CallOutcome(found, {}, {}), 1


def test_a_call_that_finds_everything_as_it_was_is_not_run_again_and_writes_what_it_wrote() -> None:
    call = Called()
    first = call()
    call.store.set(("object", "name"), literal("something else"))
    assert call() == first == call.store.get(("object", "name"))
    assert call.runs == 1


def test_it_is_run_again_when_it_gets_another_argument() -> None:
    call = Called()
    call(literal("x"))
    call(literal("y"))
    assert call.runs == 2


def test_it_is_run_again_when_a_variable_that_it_read_has_changed() -> None:
    call = Called()
    call()
    call.store.set(("object", "topic"), literal("c"))
    assert call() == (*literal("c"), *literal("b"))


def test_it_is_run_again_when_a_note_that_it_read_has_changed() -> None:
    call = Called()
    call()
    call.notes["default"] = "c"
    assert call() == (*literal("a"), *literal("c"))


def test_who_calls_it_depends_on_what_it_read_too_also_where_it_was_not_run() -> None:
    call = Called()
    call()

    def caller() -> None:
        call()

    reads = call.store.watched(caller)
    assert call.runs == 1
    assert call.store.holds(reads)
    call.store.set(("object", "topic"), literal("c"))
    assert not call.store.holds(reads)


HELPED = """
  void make() { create_publisher<std_msgs::msg::String>(name(), 1); }
  std::string name() { return prefix_ + suffix(); }
  std::string suffix() { return suffix_; }
  std::string prefix_ = "a", suffix_ = "1";
"""


def test_a_helper_is_followed_again_for_each_value_that_callbacks_give_to_what_it_reads(
    tmp_path: Path,
) -> None:
    timers = """
      t1_ = create_wall_timer(s, [this]() { make(); });
      t2_ = create_wall_timer(s, [this]() { suffix_ = "2"; });
      t3_ = create_wall_timer(s, [this]() { prefix_ = "b"; });
    """
    assert set(names(infer(tmp_path, in_class(timers, HELPED)))) == {"a1", "a?", "b?"}


def test_and_only_once_where_nobody_changes_it(tmp_path: Path) -> None:
    timers = "t1_ = create_wall_timer(s, [this]() { make(); make(); });"
    assert names(infer(tmp_path, in_class(timers, HELPED))) == ["a1"]


def test_a_method_that_may_write_a_name_leaves_each_that_callbacks_gave_it(tmp_path: Path) -> None:
    """What it leaves depends on what was there, though it reads nothing."""
    made = (
        "create_wall_timer(1s, [this]() { may(now()); create_publisher<std_msgs::msg::String>(name, 1); });"
    )
    other = 'create_wall_timer(2s, [this]() { name = "c"; });'
    members = 'bool now(); void may(bool is) { if (is) { name = "a"; } } std::string name = "b";'
    assert names(infer(tmp_path, in_class(made + other, members))) == ["a", "b", "c"]


ASKS_AGAIN = """
  void first() { client->async_send_request(request, [this](Future) { second(); first(); WRITES }); }
  void second() { client->async_send_request(request, [this](Future) { first(); second(); third(); }); }
  void third() { client->async_send_request(request, [this](Future) { first(); second(); third(); }); }
  std::shared_ptr<rclcpp::Client<std_srvs::srv::Empty>> client; std::shared_ptr<std_srvs::srv::Empty::Request> request;
  std::string name = "a";
"""
ASKS = """
  client = create_client<std_srvs::srv::Empty>("asked"); first(); second();
  create_wall_timer(1s, [this]() { create_publisher<std_msgs::msg::String>(name, 1); });
"""


def test_answers_that_ask_again_in_all_orders_are_followed_to_their_end(tmp_path: Path) -> None:
    system = infer(tmp_path, in_class(ASKS, ASKS_AGAIN.replace("WRITES", "")))
    assert (names(system), gaps(system)) == (["a", "asked"], [])


def test_what_they_change_is_not_taken_for_unchanged(tmp_path: Path) -> None:
    system = infer(tmp_path, in_class(ASKS, ASKS_AGAIN.replace("WRITES", 'name = name + "b";')))
    assert set(names(system)) > {"a", "asked"} or gaps(system)
