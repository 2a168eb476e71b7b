"""What one can ask of `play`; to be read without anything heavy."""

import dataclasses
from pathlib import Path

from go1_mtl_gym.errors import InvalidInputError
from go1_mtl_gym.validation import integer_in
from trainers.utils.validation import checked_seed

MAX_PIXELS = 16384
"""Of a side of the picture."""
LOOPBACK = "127.0.0.1"
PORT = 8080
MAX_PORT = 65535
WEB_PACKAGES = ("viser", "trimesh")
"""Of the extra `web`."""


@dataclasses.dataclass(frozen=True)
class PlayOptions:
    """Drive a policy or the expert in a window or a browser, by keys or a gamepad, or let a script drive; film it.

    Attributes:
        policy: File of a policy, "clocked" or "phase_free" (in the package), or "expert" (clocked if not given). As
            the first word it needs no --policy.
        task: Gait to begin with (the first one that the policy knows if not given).
        seed: Of the stand that it begins with (1 if not given).
        script: JSON file of a trainers.Script, which drives instead of you.
        save_script: Write down what you do, since the last reset, as such a file.
        replay: File or folder of a certificate, one of whose episodes drives instead of you.
        episode: Which one, such as "operator/trot/17".
        record: Film it: .mp4, .gif, .webp, or .png for the last picture; scripts and replays without a window.
        ghost: Show the pose that the expert asks for.
        web: Show it in a browser, as without a display, rather than in a window.
        host: Interface that the browser's page is served on; others than the loopback let others drive.
        port: Of that page; 0 takes a free one.
        size: Of window or film [pixels] (1280 720 if not given; of GIF and WebP without a window 640 360).
        fps: Pictures per second of the film.

    Raises:
        InvalidInputError: if two of them contradict each other, or one is not as described.
    """

    policy: str | None = None
    task: str | None = None
    seed: int | None = None
    script: Path | None = None
    save_script: Path | None = None
    replay: Path | None = None
    episode: str | None = None
    record: Path | None = None
    ghost: bool = False
    web: bool = False
    host: str = LOOPBACK
    port: int = PORT
    size: tuple[int, int] | None = None
    fps: int = 25

    def __post_init__(self) -> None:
        self._check_together()
        if self.seed is not None:
            checked_seed(self.seed)
        for length, side in zip(self.size or (), ("width", "height")):
            integer_in(length, 1, MAX_PIXELS, f"{side} of the picture [pixels]")
        integer_in(self.port, 0, MAX_PORT, "port")

    def _check_together(self) -> None:
        """Refuse options that contradict each other."""
        if self.script is not None and self.replay is not None:
            raise InvalidInputError("one thing can drive: give --script or --replay, got both")
        if (self.replay is None) != (self.episode is None):
            raise InvalidInputError(
                '--replay FILE and --episode NAME belong together, such as --episode "operator/trot/17"'
            )
        if self.script is not None or self.replay is not None:
            if self.web and self.record is not None:
                raise InvalidInputError(
                    "what a script or a replay does is filmed unseen: give --record or --web, got both"
                )
            self.refuse_hands(f"{'--script' if self.replay is None else '--replay'} says everything")
        if self.replay is not None and self.seed is not None:
            raise InvalidInputError("--replay says everything; beside it came --seed")

    def refuse_hands(self, reason: str) -> None:
        """Refuse what is of use only where hands drive.

        Raises:
            InvalidInputError: if it was asked for; the message begins with the reason.
        """
        for name in ("task", "save_script"):
            if getattr(self, name) is not None:
                raise InvalidInputError(f"{reason}; beside it came --{name.replace('_', '-')}")
