/** Physics and policy beside the page: slow drawing slows no time down. */
import { beginning } from "./beginning.js";
import { Loading } from "./loading.js";
import { robotGeometry, Poses } from "./poses.js";

const DEBT_S = 0.1; // the most time that is made up for: a hidden tab does not fast-forward
const BREAK_MS = 4;

/** What the page sends once the robot is there: {type, ...}. */
const handlers = {
  move: ({ kind, values }) => {
    if (!state.session.move(kind, values)) postMessage({ type: "refused", message: "The network that this needs could not be loaded." });
  },
  speed: ({ speed }) => (state.speed = speed),
  step: () => tick(),
  begin: (how) => state.session.begin(beginning(how, state.session.robot.constants)),
  tour: () => postMessage({ type: "tour", tour: state.session.tour, full: state.session.full }),
};
const state = { speed: 1, session: null, poses: null };
const loading = new Loading(self.location); // without waiting for the page

onmessage = ({ data }) => {
  if (data.type === "start") start(data).catch(({ message }) => postMessage({ type: "failed", message }));
  else if (data.type === "speed" || state.session !== null) handlers[data.type](data);
};

/** Begin as soon as the first gait can, and load the rest meanwhile. */
async function start({ begin: asked, instead }) {
  const constants = await loading.constants, tasks = Object.keys(constants.tasks);
  const begin = beginningOr(instead, asked, constants), wanted = tasks[begin.task];
  const session = await loading.session([wanted, ...tasks.filter((name) => name !== wanted)]);
  const first = tasks.find((name) => session.isReady(name));
  session.begin(first === wanted ? begin : without(wanted, tasks.indexOf(first), begin, instead, constants));
  const { simulation } = session.robot;
  Object.assign(state, { session, poses: new Poses(simulation) });
  const weights = loading.clocked.policy.shared.file.split("/").at(-1);
  postMessage({ type: "ready", constants, geometry: robotGeometry(simulation.mj, simulation), weights, drivenWith: begin.weights ?? null, first });
  run();
  const came = (kind, name) => postMessage({ type: kind, name });
  await loading.rest(tasks, came, (kind, name, message) => postMessage({ type: "missing", kind, name, message }));
  session.complete = true;
}

/** What is asked for; if that is a link which holds no tour, what comes instead, and the page hears of it. */
function beginningOr(instead, asked, constants) {
  try {
    return beginning(asked, constants);
  } catch ({ message }) {
    postMessage({ type: "noTour", message });
    return beginning(instead, constants);
  }
}

/** What comes instead of a beginning in a gait whose network is missing; a tour would be another one. */
function without(wanted, task, begin, instead, constants) {
  const isTour = begin.weights !== undefined;
  if (isTour) postMessage({ type: "noTour", message: `the network of ${wanted}, in which the link begins, could not be loaded` });
  return { ...(isTour ? beginning(instead, constants) : begin), task };
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
    stands: session.stands,
    replaying: session.replaying,
    policy: session.names[session.policy],
    pulled: session.pulled,
  };
}
