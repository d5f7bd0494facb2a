"""Keys of profiles that are gone: a remark where the policy does so anyway, else a refusal."""

from __future__ import annotations

import re
from typing import Any

import pytest
import yaml

from behaviors.profile.old_keys import OLD_KEYS, OldKey, drop_old_keys
from behaviors.profile.profile import load_profile
from engine.files.declared.item import notes, parse_yaml
from engine.files.finding import FileError
from engine.files.source import plain

SWITCH = OldKey("take another policy", {"paper": ("zones",), "tuned": ("contact",)})
UNREAD = OldKey("drop it", None)
SENTINEL = OldKey("give a risk above 0", {"paper": (0,)}, (0,))
OLD = {"escape.trigger": SWITCH, "chase.seed": UNREAD, "chase.risk": SENTINEL, "gone": UNREAD}


def read(text: str, policy: str) -> tuple[Any, list[str]]:
    """What is left of a layer of a profile, and the remarks."""
    left = {}

    def dropped(item: Any) -> None:
        drop_old_keys(item, policy, OLD)
        left.update(plain(item.value))

    with notes() as told:
        parse_yaml(text, "mine.yaml", dropped)
    return left, [str(FileError([note])) for note in told]


@pytest.mark.parametrize(
    ("policy", "text", "left"),
    [
        ("paper", "escape: {trigger: zones, ahead: 2 m}", {"escape": {"ahead": "2 m"}}),
        ("tuned", "escape: {trigger: contact}", {"escape": {}}),
        ("tuned", "chase: {seed: 7}", {"chase": {}}),
        ("paper", "chase: {risk: 0, inner: 2 m}", {"chase": {"inner": "2 m"}}),
    ],
)
def test_what_the_policy_does_anyway_is_dropped_with_a_remark(
    policy: str, text: str, left: Any
) -> None:
    found, (told,) = read(text, policy)

    assert found == left
    assert told.startswith("mine.yaml:1:")
    assert "is gone" in told


@pytest.mark.parametrize(
    ("policy", "text", "told"),
    [
        ("tuned", "escape: {trigger: zones}", "1:19: escape.trigger: 'zones' is gone"),
        ("paper", "escape: {trigger: contact}", "take another policy"),
        ("tuned", "chase: {risk: 0}", "chase.risk: 0 is gone; give a risk above 0"),
    ],
)
def test_what_the_policy_does_not_do_is_refused_with_what_there_is(
    policy: str, text: str, told: str
) -> None:
    with pytest.raises(FileError) as failure:
        read(text, policy)
    assert told in str(failure.value)


def test_what_there_still_is_is_left_alone() -> None:
    text = "escape: {ahead: 2 m}\nchase: {risk: 3}\nplant: 5"

    found, told = read(text, "tuned")

    assert found == {"escape": {"ahead": "2 m"}, "chase": {"risk": 3}, "plant": 5}
    assert not told


SAID = [
    (key, policy, value)
    for key, old in OLD_KEYS.items()
    for policy, values in (old.said or {"paper": (7,), "tuned": (7,)}).items()
    for value in values
]


@pytest.mark.parametrize(("key", "policy", "value"), SAID)
def test_a_profile_that_says_what_its_policy_does_is_read_as_if_it_did_not(
    key: str, policy: str, value: Any
) -> None:
    with notes() as told:
        found = load_profile(policy, [f"{key}={yaml.safe_dump(value).split()[0]}"])

    assert found.settings == load_profile(policy).settings
    assert [note.message.partition(":")[0] for note in told] == [key]
    assert told[0].hint


@pytest.mark.parametrize(
    ("key", "policy", "value"),
    [(key, policy, value) for key, policy, value in SAID if OLD_KEYS[key].said is not None],
)
def test_what_the_other_policy_says_is_refused(key: str, policy: str, value: Any) -> None:
    (other,) = {"paper", "tuned"} - {policy}
    old = OLD_KEYS[key]
    if value in (old.said or {}).get(other, ()):
        return
    with pytest.raises(FileError, match=re.escape(old.instead)):
        load_profile(other, [f"{key}={yaml.safe_dump(value).split()[0]}"])
