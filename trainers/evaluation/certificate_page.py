"""The page of a certificate, in Markdown."""

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence

from trainers.evaluation.cells import ALL_GAITS, Cell, Settings
from trainers.evaluation.stopping import MET, Plan
from trainers.utils.report import markdown, number

MARKS = {"met": "met", "refuted": "**refuted**", "open": "**open**"}
LISTED = 40
"""Failed episodes that are listed one by one; the file holds all."""


def page(
    policy: Mapping[str, str],
    reference: Mapping[str, str] | None,
    settings: Settings,
    versions: Mapping[str, str],
    cells: Sequence[Cell],
) -> str:
    """All of it: summary, matrix, cells, causes, failed episodes, comparison and method.

    Args:
        policy: "name" and "sha256".
        reference: likewise, or None.
        settings: that all cells have in common.
        versions: of packages.
        cells: in the order of the tables.
    """
    parts = [_head(policy, cells), _matrix(cells), "## Cells", _cells(cells)]
    if any(cell.failures for cell in cells):
        parts += ["## Causes of the failures", _causes(cells), "## Failed episodes", _episodes(cells)]
    if reference is not None:
        parts += [f"## Compared with {reference['name']}", _comparison(cells)]
    return "\n\n".join([*parts, "## Method", _method(settings, versions, cells)]) + "\n"


def _head(policy: Mapping[str, str], cells: Sequence[Cell]) -> str:
    met = sum(cell.verdict == MET for cell in cells)
    return (
        f"# Certificate of {policy['name']}\n\n"
        f"{met} of {len(cells)} claims are met, in {sum(cell.trials for cell in cells)} episodes. "
        f"SHA-256 of the policy: `{policy['sha256']}`."
    )


def _distinct(values: Iterable[str]) -> list[str]:
    return list(dict.fromkeys(values))


def _matrix(cells: Sequence[Cell]) -> str:
    """Conditions by gaits."""
    named = {(cell.condition.title, cell.task): cell for cell in cells}
    gaits = _distinct(task for _, task in named)
    gaits = [*(gait for gait in gaits if gait != ALL_GAITS), *(gait for gait in gaits if gait == ALL_GAITS)]

    def short(title: str, gait: str) -> str:
        cell = named.get((title, gait))
        if cell is None:
            return "-"
        counts = f"{cell.passed}/{cell.trials}"
        return counts if cell.verdict == MET else f"**{counts}**"

    rows = [[title, *(short(title, gait) for gait in gaits)] for title in _distinct(title for title, _ in named)]
    table = markdown(["condition", *gaits], rows)
    return f"{table}\n\nSuccessful episodes of all, or survived ones where that is the claim; bold where it is not met."


def _cells(cells: Sequence[Cell]) -> str:
    header = [
        "condition",
        "gait",
        "survived",
        "succeeded",
        "rate's interval",
        "at least",
        "claim",
        "verdict",
        "error [m/s]",
    ]
    rows = []
    for cell in cells:
        low, high = cell.interval
        counts = [f"{count}/{cell.trials}" for count in (cell.survived, cell.succeeded)]
        rates = [f"{low:.2%} ... {high:.2%}", f"{cell.lower_bound:.2%}", f"{cell.plan.claim:.2%}"]
        names = [cell.condition.title, cell.task]
        rows.append([*names, *counts, *rates, MARKS[cell.verdict], number(cell.velocity_error, ".3f")])
    return markdown([*header[:-1], "velocity " + header[-1]], rows, text_columns=2)


def _causes(cells: Sequence[Cell]) -> str:
    counted: Counter[tuple[str, ...]] = Counter()
    for cell in cells:
        for failure in cell.failures:
            cause = failure.cause
            counted[cause.task, cause.what, cause.doing, cause.after] += 1
    rows = [[*key, str(count)] for key, count in counted.most_common()]
    return markdown(["gait", "what", "while", "less than a second after", "episodes"], rows, text_columns=4)


def _episodes(cells: Sequence[Cell]) -> str:
    rows = [[f"`{cell.name}/{each.number}`", str(each.cause)] for cell in cells for each in cell.failures]
    table = markdown(["episode", "cause"], rows[:LISTED], text_columns=2)
    left = f"\n\nAnd {len(rows) - LISTED} more." if len(rows) > LISTED else ""
    return f"{table}{left}\n\n`trainers.replay(certificate, episode, policy)` shows any of them."


def _comparison(cells: Sequence[Cell]) -> str:
    rows = []
    for cell in cells:
        if cell.paired is not None:
            *counts, p_value = cell.paired.values()
            rows.append([cell.condition.title, cell.task, *map(str, counts), f"{p_value:.2g}"])
    header = ["condition", "gait", "both", "only this policy", "only the other", "neither", "McNemar's p"]
    return markdown(header, rows, text_columns=2)


def _in_words(plan: Plan) -> str:
    (episodes, failures), *later = plan.looks
    more = "".join(f", or {allowed} in {count}" for count, allowed in later)
    return (
        f"{plan.claim:.2%} is met by at most {failures} failures in {episodes} episodes{more}. A policy that only just "
        f"misses it is certified with probability {plan.error:.3f}."
    )


def _method(settings: Settings, versions: Mapping[str, str], cells: Sequence[Cell]) -> str:
    plans = {cell.plan: None for cell in cells}
    looks = [f"- {_in_words(plan)}" for plan in plans if plan.looks]
    ends = "Episodes end when the answer is known. " if settings.stop_early else "No episode was left out. "
    survivors = _distinct(cell.condition.title for cell in cells if cell.condition.judged_by == "survival")
    survival = f"Judged by survival: {', '.join(survivors)}. " if survivors else ""
    arguments = ", ".join(f"{name} {value}" for name, value in settings.env_kwargs.items()) or "as the policy has it"
    packages = ", ".join(f"{name} {version}" for name, version in versions.items())
    paragraphs = [
        f"Episodes of {settings.seconds:g} s, tours of {settings.tour_seconds:g} s; seed {settings.seed}. Success: "
        f"survived, velocity error at most 0.15 m/s, and stepped at the gait's rate. {survival}"
        f"{ends}Confidence {settings.confidence:.0%}.",
        "\n".join(looks),
        "Intervals are Clopper and Pearson's, two-sided, and the lower bound one-sided; both as of a number of "
        "episodes that was decided beforehand. "
        f"Environment: {arguments}. {packages}.",
    ]
    return "\n\n".join(paragraph for paragraph in paragraphs if paragraph)
