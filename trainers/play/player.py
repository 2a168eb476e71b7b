"""A session by the clock on the wall: real time, slow motion, pauses, and what happens after a fall."""

from collections import deque

from go1_mtl_gym.validation import number_in
from trainers.play.camera import Camera
from trainers.play.hands import Hands
from trainers.play.session import Session

SPEEDS = (0.1, 0.25, 0.5, 1.0)
"""Of slow motion, and real time."""
LONGEST_DEBT_S = 0.5
"""A picture that took longer than this is not made up for: the robot is slow then, as the real-time factor says [s]."""
LYING_S = 1.5
"""How long a robot that fell stays on the ground [s]."""
FACTOR_S = 1.0
"""Time on the wall that the real-time factor is measured over [s]."""


class Player:
    """What a player sees and does, but for the window.

    Args:
        session: that is played.
        hands: that drive it; None if it is driven by something else.
        stands_up: whether the session begins again by itself after a fall.
        title: what drives, where no hands do.

    Attributes:
        camera: where the player looks from.
        paused: whether time stands still.
        speed: of the time, one of `SPEEDS`.
        ghost: whether the pose that the expert asks for is shown.
        help: whether the keys are shown.
        played_s: time that was shown, over all episodes; slow motion counts as long as it took [s].
        factor: simulated time per time on the wall, lately.
    """

    def __init__(
        self, session: Session, hands: Hands | None = None, *, stands_up: bool = True, title: str = ""
    ) -> None:
        self.session, self.hands, self.title = session, hands, title
        self.camera = Camera()
        self.paused = self.ghost = False
        self.help = hands is not None
        self.speed, self.played_s, self.factor = 1.0, 0.0, 1.0
        self._stands_up = stands_up
        self._debt_s = self._wall_s = self._simulated_s = self._lying_s = 0.0
        self._marks: deque[tuple[float, float]] = deque([(0.0, 0.0)])
        self.look()

    @property
    def over(self) -> bool:
        """Whether nothing moves any more."""
        return self.session.ended in ("time", "unstable") or self._lying_s >= LYING_S

    def advance(self, wall_s: float) -> int:
        """Let time on the wall pass.

        Args:
            wall_s: how much [s].

        Returns:
            The number of steps that were due, and made.

        Raises:
            InvalidInputError: if it is no number in [0, 3600].
        """
        wall_s = number_in(wall_s, 0.0, 3600.0, "passed time [s]")
        control_s, made = self.session.go1.control_s, 0
        if not self.paused:
            self._debt_s = min(self._debt_s + self.speed * wall_s, max(LONGEST_DEBT_S, control_s))
        while self._debt_s >= control_s - 1e-9 and not self.paused:
            self._debt_s -= control_s
            made += self.step()
        self._measure(wall_s, made * control_s)
        return made

    def step(self) -> int:
        """Go on for one control period, whether paused or not; 1, or 0 where nothing moves any more."""
        if self.over and self._stands_up:
            self.reset()
        if self.over:
            return 0
        self.session.step()
        self.played_s += self.session.go1.control_s / self.speed
        if self.session.ended == "fall":
            self._lying_s += self.session.go1.control_s
        self.look()
        return 1

    def reset(self) -> None:
        """Begin again: hands in the gait that they asked for last, anything else as it began."""
        driven = self.hands is not None
        self.session.reset(self.session.go1.requested_task.name if driven else None)
        self._lying_s = 0.0
        self.look()

    def look(self) -> None:
        """Let the camera follow."""
        state = self.session.go1.state
        self.camera.follow(state.position_w, float(state.rpy[2]), self.session.time_s)

    def slower(self, steps: int = 1) -> None:
        """Slow the time down by so many of the `SPEEDS`; negative speeds it up, as far as real time."""
        place = SPEEDS.index(self.speed) - steps
        self.speed = SPEEDS[min(max(place, 0), len(SPEEDS) - 1)]

    def _measure(self, wall_s: float, simulated_s: float) -> None:
        self._wall_s += wall_s
        self._simulated_s += simulated_s
        self._marks.append((self._wall_s, self._simulated_s))
        while len(self._marks) > 2 and self._marks[1][0] <= self._wall_s - FACTOR_S:
            self._marks.popleft()
        wall, simulated = self._marks[0]
        if self._wall_s > wall:
            self.factor = (self._simulated_s - simulated) / (self._wall_s - wall)
