/** Physics and policy beside the page: slow drawing slows no time down. */
import { demo } from "./demo.js";
import { Loading } from "./loading.js";
import { robotGeometry, Poses } from "./poses.js";

const DEBT_S = 0.1; // the most time that is made up for: a hidden tab does not fast-forward
const BREAK_MS = 4;

/** What the page sends once the robot is there: {type, ...}. */
const handlers = {
  move: ({ kind, values }) => state.session.move(kind, values),
  speed: ({ speed }) => (state.speed = speed),
  step: () => tick(),
  begin: (how) => state.session.begin(how.demo ? demo(state.session.robot.constants) : how),
  tour: () => postMessage({ type: "tour", tour: state.session.tour, full: state.session.full }),
};
const state = { speed: 1, session: null, poses: null };
const loading = new Loading(self.location); // without waiting for the page

onmessage = ({ data }) => {
  if (data.type === "start") start(data).catch((error) => postMessage({ type: "error", message: String(error) }));
  else if (data.type === "speed" || state.session !== null) handlers[data.type](data);
};

/** Begin as soon as the first gait can, and load the rest meanwhile. */
async function start({ begin: asked }) {
  const constants = await loading.constants, tasks = Object.keys(constants.tasks);
  const begin = asked.demo ? demo(constants) : asked, first = tasks[begin.task];
  if (first === undefined) throw new Error(`the link asks for gait ${begin.task + 1}, there are ${tasks.length}`);
  const session = await loading.session(first);
  session.begin(begin);
  const { simulation } = session.robot;
  Object.assign(state, { session, poses: new Poses(simulation) });
  const weights = loading.clocked.policy.shared.file.split("/").at(-1);
  postMessage({ type: "ready", constants, geometry: robotGeometry(simulation.mj, simulation), weights, first });
  run();
  await loading.rest(tasks, (type, name) => postMessage({ type, name }));
}

/** Let a control period pass, and tell the page of it. */
function tick() {
  const { session, poses } = state;
  if (!session.tick((number) => poses.watch(number))) return;
  postMessage(report(session, poses.take(session.step / session.robot.constants.control_hz)));
}

/** Keep the robot's time to the clock on the wall. */
function run() {
  const controlS = 1 / state.session.robot.constants.control_hz;
  let last = performance.now(), owedS = 0;
  const turn = () => {
    const now = performance.now();
    owedS = Math.min(owedS + (state.speed * (now - last)) / 1000, DEBT_S);
    last = now;
    for (; owedS >= controlS; owedS -= controlS) tick();
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
  };
}
