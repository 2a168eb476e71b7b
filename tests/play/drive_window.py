"""A window that another process types into: prints a line of JSON per picture, as `test_window.py` reads it."""

import json
import sys

import numpy as np
from PIL import Image

import trainers
from tests.play.conftest import Stand
from trainers.evaluation.episodes import EpisodeSetup
from trainers.play.hands import Hands
from trainers.play.loop import play_on
from trainers.play.player import Player
from trainers.play.session import Session
from trainers.play.window import Window


def main(picture: str) -> None:
    hands = Hands()
    setup = EpisodeSetup("trot", 3, 1e6, command=(0.0, 0.0, 0.0))
    with Session(trainers.load_pretrained(), setup, hands.drive, expert=Stand) as session:
        player = Player(session, hands)
        window = Window(player, 320, 180)

        def tell() -> None:
            said = {
                "stick": hands.stick.tolist(),
                "task": session.go1.requested_task.name,
                "steps": session.steps,
                "speed": float(np.hypot(*session.reading.measured[:2])),
                "driver": session.driver,
                "paused": player.paused,
                "ghost": player.ghost,
                "help": player.help,
                "azimuth": player.camera.mjv.azimuth,
                "factor": player.factor,
            }
            print(json.dumps(said), flush=True)

        play_on(window, player, each=tell)
        Image.fromarray(window.picture()).save(picture)
        hands.script.write(picture + ".json")
        np.save(picture + ".npy", session.go1.simulation.snapshot())
        window.close()


if __name__ == "__main__":
    main(sys.argv[1])
