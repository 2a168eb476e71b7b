"""What a person sees of the main job while it runs: which stage, one bar for it, and how long it will take."""

import contextlib
import sys
import threading
from collections.abc import Iterator, Mapping

from tqdm.auto import tqdm

from trainers.pipeline.config import JobConfig
from trainers.pipeline.forecast import Parts, left_s, parts, seconds_of, spoken
from trainers.utils.progress import as_text, reporting_to

TITLES = {
    "demonstrations": "demonstrations of the expert",
    "clone": "cloning",
    "dagger": "DAgger",
    "phase_free": "the policy without a clock",
    "baselines": "baselines",
    "evaluation": "evaluation",
    "pictures": "pictures",
}
"""Stage -> what a person calls it."""
FORMAT = "      {desc:<30.30} {percentage:3.0f}%|{bar:24}| {elapsed}<{remaining}{postfix}"
LOG_INTERVAL_S = 30.0
"""How often a bar is written where its output is no terminal [s]."""
SLOW_S = 4.0
"""What takes longer than this is announced [s]."""


class Stages:
    """The stages of a job, announced one by one on stderr.

    Args:
        config: of the job.
        shown: False says nothing.
        measured: stage -> wall time [s], as they come to be known; read whenever a stage begins.
    """

    def __init__(self, config: JobConfig, shown: bool, measured: Mapping[str, float]) -> None:
        self.parts = parts(config)
        self.expected = {name: seconds_of(stage) for name, stage in self.parts.items()}
        self.shown = shown
        self.measured = measured
        self._finished: set[str] = set()

    @contextlib.contextmanager
    def stage(self, name: str) -> Iterator[None]:
        """Announce a stage; bars that are made in the block are parts of its one bar."""
        if not self.shown or name not in self.parts:
            yield
            return
        say(self.headline(name))
        with _StageBar(name.replace("_", "-"), self.parts[name]) as bar, reporting_to(bar):
            yield
        self._finished.add(name)

    def skip(self, name: str) -> None:
        """Say that a stage was done before."""
        if self.shown and name in self.parts:
            say(f"{self._count(name)} {TITLES[name]}: done before")
            self._finished.add(name)

    def headline(self, name: str) -> str:
        """Which stage, and how long: "[3/7] DAgger: about 6 min, then 10 min more"."""
        names = list(self.parts)
        rest = names[names.index(name) + 1 :]
        done = {stage: self.measured[stage] for stage in self._finished if stage in self.measured}
        now, then = left_s(self.expected, done, [name]), left_s(self.expected, done, rest)
        more = f", then {spoken(then)} more" if rest else ""
        return f"{self._count(name)} {TITLES[name]}: about {spoken(now)}{more}"

    def _count(self, name: str) -> str:
        return f"[{list(self.parts).index(name) + 1}/{len(self.parts)}]"


@contextlib.contextmanager
def announced_if_slow(sentence: str, shown: bool = True, after_s: float = SLOW_S) -> Iterator[None]:
    """Say something if a block takes long, while it does.

    Args:
        sentence: what to say.
        shown: False says nothing.
        after_s: how long is long [s].
    """
    timer = threading.Timer(after_s, say, [f"      {sentence}"])
    timer.daemon = True
    if shown:
        timer.start()
    try:
        yield
    finally:
        timer.cancel()


def say(line: str) -> None:
    """Write a line to stderr, above a bar if there is one."""
    tqdm.write(line, file=sys.stderr)


class _StageBar:
    """One bar for all parts of a stage, which moves with the time that they were guessed to take.

    Args:
        title: of the stage.
        stage: its parts.
    """

    def __init__(self, title: str, stage: Parts) -> None:
        self._each = {kind: each for kind, (_, each) in stage.items()}
        self._title = title
        self._done = 0.0
        self._total = seconds_of(stage)
        self._part = ""
        interval = 0.1 if sys.stderr.isatty() else LOG_INTERVAL_S
        self._bar = tqdm(desc=title, total=self._total, bar_format=FORMAT, mininterval=interval, file=sys.stderr)

    def __enter__(self) -> "_StageBar":
        return self

    def __exit__(self, kind: object, error: object, trace: object) -> None:
        if kind is None:
            self._show(self._total)
        self._bar.close()

    def advance(self, title: str, fraction: float) -> None:
        """Of the part that is at work now, so much is done."""
        weight = self._each.get(title.partition(" ")[0].lower(), 0.0)
        if title != self._part:
            self._part = title
            self._bar.set_description_str(f"{self._title}: {title}", refresh=False)
            self._bar.set_postfix_str("", refresh=False)
        self._show(self._done + weight * fraction)
        if fraction >= 1.0:
            self._done = min(self._total, self._done + weight)
            self._part = ""

    def note(self, **figures: object) -> None:
        """Show figures beside the bar."""
        self._bar.set_postfix_str(as_text(figures), refresh=False)

    def _show(self, done: float) -> None:
        self._bar.update(max(0.0, min(done, self._total) - self._bar.n))
