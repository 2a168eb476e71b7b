/** The robot under a policy: the environment of `go1_mtl_gym.Go1Env`, stepped by its own network. */
import { Episode } from "./episode.js";
import { measure } from "./observation.js";

export class Robot {
  /**
   * @param simulation of the robot.
   * @param controller with `reset()`, `observe(parts, gait)` and `act()`.
   */
  constructor(simulation, controller) {
    this.simulation = simulation;
    this.constants = simulation.constants;
    this.controller = controller;
  }

  /**
   * Begin an episode from a stand.
   *
   * @param taskName of the gait.
   * @param command (vx [m/s], vy [m/s], yaw rate [rad/s]).
   * @param q joint positions [rad]; the standing pose if there are none.
   */
  reset(taskName, command = [0, 0, 0], q = this.constants.robot.home_pose) {
    this.simulation.reset(q);
    this.episode = new Episode(this.constants, this.constants.tasks[taskName], command);
    this.controller.reset();
    this.#look();
  }

  /** Let the policy drive for one control period. */
  step(beforePhysicsStep = null) {
    this.apply(this.controller.act(), beforePhysicsStep);
  }

  /** Hold one action for a control period. */
  apply(action, beforePhysicsStep = null) {
    const { actuators, physics_hz: physicsHz, control_hz: controlHz } = this.constants;
    const applied = Float64Array.from(action);
    const target = applied.map((value, i) => actuators.default_q[i] + actuators.action_scale[i] * value);
    this.simulation.step(target, Math.round(physicsHz / controlHz), beforePhysicsStep);
    this.episode.advance(applied);
    this.#look();
  }

  /**
   * Drive with another policy from now on.
   *
   * @param inMidstride whether an episode goes on with it; otherwise a reset follows.
   */
  setController(controller, inMidstride = true) {
    controller.reset();
    this.controller = controller;
    if (inMidstride) controller.observe(this.parts, this.episode.task.gait);
  }

  setCommand(command) {
    this.episode.command = command;
  }

  setTask(taskName) {
    this.episode.changeTask(this.constants.tasks[taskName]);
  }

  #look() {
    this.parts = measure(this.simulation.read(), this.episode, this.constants.robot);
    this.controller.observe(this.parts, this.episode.task.gait);
  }
}
