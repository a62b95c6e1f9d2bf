"""What is to be delivered is said in known words."""

from typing import Any

import pytest

from dafnet_addon.core.errors import InputError
from dafnet_addon.core.wishes import Wishes


def test_words_are_taken_alone_or_in_lists_and_put_in_order() -> None:
    wishes = Wishes(render=["depth", "Frames"], export="FBX")  # type: ignore[arg-type]
    assert wishes.render == ("frames", "depth") and wishes.export == ("fbx",)
    assert wishes.anything and not Wishes(every=3).anything


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"render": ["mask"]}, "'render' does not know 'mask'; did you mean 'masks'"),
        ({"export": "glb"}, "'export' does not know 'glb'"),
        ({"render": 3}, "'render' is 3; give a list"),
        ({"render": [3]}, "'render' does not know '3'; known are"),
        ({"every": 0}, "'every' is 0"),
        ({"truth": "yes"}, "'truth' is yes; write true or false"),
        ({"root_motion": "hip"}, "did you mean 'hips'"),
        ({"rig": ""}, "'rig' is not a name"),
    ],
)
def test_what_is_not_known_is_named(given: dict[str, Any], said: str) -> None:
    with pytest.raises(InputError, match=said):
        Wishes(**given)
