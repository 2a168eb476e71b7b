"""The certificates in the documentation are of the policies in the package."""

import json
from pathlib import Path

import pytest

from trainers.evaluation.agents import identity

RESULTS = Path(__file__).parents[2] / "docs" / "results"


@pytest.mark.parametrize("path", sorted(RESULTS.glob("certificate_*.json")), ids=lambda path: path.stem)
def test_a_certificate_is_of_what_is_in_the_package(path):
    policy = json.loads(path.read_text(encoding="utf-8"))["policy"]
    assert policy == identity(policy["name"])
