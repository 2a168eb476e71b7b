/** What the robot is made of, fetched and put together: first what the first gait needs, the rest while it moves. */
import { Clocked, PhaseFree } from "./controllers.js";
import { compileModule, loadModule } from "./mujoco_module.js";
import { PhaseEstimator, Student } from "./network.js";
import { Robot } from "./robot.js";
import { Session } from "./session.js";
import { Simulation } from "./simulation.js";

export class Loading {
  /** @param base address of the files; what every beginning needs is asked for at once, side by side. */
  constructor(base) {
    this.base = base;
    const scene = { "go1.xml": this.#text("model/go1.xml"), "scene.xml": this.#text("model/scene.xml") };
    const mujoco = this.#get("mujoco.wasm").then(compileModule).then(marked("MuJoCo compiled")).then(loadModule);
    this.constants = this.#get("constants.json").then((response) => response.json());
    this.simulation = this.#simulation(mujoco, scene);
    this.student = this.constants.then(async ({ policies: { multi_head: policy } }) => new Student(policy, await this.#buffer(policy.shared.file)));
    for (const each of [this.simulation, this.student]) each.catch(() => {}); // whoever awaits it hears of a failure
  }

  /**
   * The session, with a network for its first gait alone.
   *
   * @param tasks names of the gaits; the first one whose network comes is enough.
   */
  async session(tasks) {
    const { policies } = await this.constants;
    const student = await this.student.then((loaded) => this.#addFirst(loaded, tasks));
    const simulation = await this.simulation;
    this.clocked = student;
    this.controllers = { multi_head: new Clocked(simulation.constants, student) };
    if (policies.phase_free !== undefined) this.controllers.phase_free = new PhaseFree(simulation.constants, policies.phase_free);
    return new Session(new Robot(simulation, this.controllers.multi_head), this.controllers);
  }

  /**
   * Fetch the other networks, one after another; one that does not come keeps none that follows.
   *
   * @param tasks names of the gaits.
   * @param came called with the kind of thing that came, "gait" or "policy", and its name.
   * @param missing called likewise with what did not come, and the reason.
   */
  async rest(tasks, came, missing) {
    const attempt = (kind, name, work) => work().then(() => came(kind, name), ({ message }) => missing(kind, name, message));
    for (const name of tasks.filter((other) => !this.clocked.has(other))) {
      await attempt("gait", name, () => this.#addHead(this.clocked, name));
    }
    const { phase_free: controller } = this.controllers;
    if (controller !== undefined) await attempt("policy", "phase_free", () => this.#loadPhaseFree(controller, missing));
  }

  async #loadPhaseFree(controller, missing) {
    const { student: policy, estimator } = controller.policy;
    let student = this.clocked;
    if (policy.shared.file !== student.policy.shared.file) {
      student = new Student(policy, await this.#buffer(policy.shared.file));
      for (const name of Object.keys(policy.heads)) {
        await this.#addHead(student, name).catch(({ message }) => missing("policy", `phase_free in ${name}`, message));
      }
    }
    controller.load(student, new PhaseEstimator(estimator, await this.#buffer(estimator.weights.file)));
  }

  /** @throws what happened to the first network, if none comes. */
  async #addFirst(student, tasks) {
    const failures = [];
    for (const name of tasks) {
      try {
        return await this.#addHead(student, name);
      } catch (error) {
        failures.push(error);
      }
    }
    throw failures[0];
  }

  async #simulation(mujoco, texts) {
    const files = {};
    for (const [name, text] of Object.entries(texts)) files[name] = await text;
    const constants = await this.constants, module = await mujoco.then(marked("MuJoCo initialized"));
    const simulation = new Simulation(module, files, constants);
    performance.mark("robot's model compiled");
    return simulation;
  }

  async #addHead(student, task) {
    student.addHead(task, await this.#buffer(student.policy.heads[task].file));
    return student;
  }

  async #get(file) {
    const response = await fetch(new URL(file, this.base)).catch(({ message }) => {
      throw new Error(`${file}: ${message}`); // which says nothing of the file
    });
    if (!response.ok) throw new Error(`${file}: ${response.status} ${response.statusText}`);
    return response;
  }

  async #buffer(file) {
    return (await this.#get(file)).arrayBuffer();
  }

  async #text(file) {
    return (await this.#get(file)).text();
  }
}

/** A step that lets everything through, and marks the time for `first_motion.mjs`. */
function marked(name) {
  return (value) => {
    performance.mark(name);
    return value;
  };
}
