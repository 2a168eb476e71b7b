/** Physics and policy beside the page: slow drawing slows no time down. */
import { Clocked, PhaseFree } from "./controllers.js";
import { demo } from "./demo.js";
import { loadModule } from "./mujoco_module.js";
import { PhaseEstimator, Student } from "./network.js";
import { Robot } from "./robot.js";
import { robotGeometry, Poses } from "./poses.js";
import { Session } from "./session.js";
import { Simulation } from "./simulation.js";

const DEBT_S = 0.1; // the most time that is made up for: a hidden tab does not fast-forward
const BREAK_MS = 4;

/** What the page sends: {type, ...}. */
const handlers = {
  move: ({ kind, values }) => state.session.move(kind, values),
  speed: ({ speed }) => (state.speed = speed),
  begin: (how) => state.session.begin(how.demo ? demo(state.session.robot.constants) : how),
  tour: () => postMessage({ type: "tour", tour: state.session.tour, full: state.session.full }),
};
const state = { speed: 1, session: null };

onmessage = ({ data }) => {
  if (data.type === "start") start(data).catch((error) => postMessage({ type: "error", message: String(error) }));
  else if (state.session !== null) handlers[data.type](data);
};

/** Load what the first gait needs, begin, and load the rest meanwhile. */
async function start({ base, begin: asked }) {
  const get = async (file) => {
    const response = await fetch(new URL(file, base));
    if (!response.ok) throw new Error(`${file}: ${response.status} ${response.statusText}`);
    return response;
  };
  const buffer = async (file) => (await get(file)).arrayBuffer();
  const text = async (file) => (await get(file)).text();
  const wasm = buffer("mujoco.wasm"), files = [text("model/go1.xml"), text("model/scene.xml")];
  const constants = await (await get("constants.json")).json();
  const policy = constants.policies.multi_head, begin = asked.demo ? demo(constants) : asked;
  const names = Object.keys(constants.tasks);
  const first = names[begin.task];
  const [shared, head] = await Promise.all([buffer(policy.shared.file), buffer(policy.heads[first].file)]);
  const student = new Student(policy, shared);
  student.addHead(first, head);
  const mj = await loadModule(await wasm);
  const [robotFile, scene] = await Promise.all(files);
  const simulation = new Simulation(mj, { "go1.xml": robotFile, "scene.xml": scene }, constants);
  const { session, late } = makeSession(simulation, student);
  session.begin(begin);
  state.session = session;
  postMessage({ type: "ready", constants, geometry: robotGeometry(mj, simulation), weights: policy.shared.file.split("/").at(-1) });
  run(new Poses(simulation));
  for (const name of names.filter((other) => other !== first)) {
    student.addHead(name, await buffer(policy.heads[name].file));
    postMessage({ type: "gait", name });
  }
  await late(buffer);
}

/** The session, and a function that loads the student without a clock once everything else is there. */
function makeSession(simulation, student) {
  const { constants } = simulation, { multi_head: clocked, phase_free: free } = constants.policies;
  const controllers = { multi_head: new Clocked(constants, student) };
  if (free === undefined) return { session: new Session(new Robot(simulation, controllers.multi_head), controllers), late: async () => {} };
  controllers.phase_free = new PhaseFree(constants, free);
  const late = async (buffer) => {
    const same = free.student.shared.file === clocked.shared.file;
    const other = same ? student : new Student(free.student, await buffer(free.student.shared.file));
    if (!same) for (const [name, head] of Object.entries(free.student.heads)) other.addHead(name, await buffer(head.file));
    controllers.phase_free.load(other, new PhaseEstimator(free.estimator, await buffer(free.estimator.weights.file)));
    postMessage({ type: "policy", name: "phase_free" });
  };
  return { session: new Session(new Robot(simulation, controllers.multi_head), controllers), late };
}

/** Keep the robot's time to the clock on the wall. */
function run(poses) {
  const { session } = state, controlS = 1 / session.robot.constants.control_hz;
  let last = performance.now(), owedS = 0;
  const turn = () => {
    const now = performance.now();
    owedS = Math.min(owedS + (state.speed * (now - last)) / 1000, DEBT_S);
    last = now;
    while (owedS >= controlS) {
      owedS -= controlS;
      if (session.tick((number) => poses.watch(number))) postMessage(report(session, poses.take(session.step * controlS)));
    }
    setTimeout(turn, BREAK_MS);
  };
  turn();
}

/** What the page shows of a control period. */
function report(session, frames) {
  const { episode, simulation } = session.robot;
  return {
    type: "step",
    frames,
    step: session.step,
    task: episode.task.gait.name,
    requested: episode.requestedTask.gait.name,
    phase: episode.phase,
    command: episode.filteredCommand,
    velocity: simulation.baseVelocity,
    contacts: simulation.contacts,
    fallen: session.fallenFor > 0,
    falls: session.falls,
    replaying: session.replaying,
    policy: session.names[session.policy],
    pulled: session.pulled,
    full: session.full,
  };
}
