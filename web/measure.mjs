/** What is published of the page, as JSON: `node measure.mjs sizes | parity | tours | first-motion [runs]`. */
import { total, sizes } from "./sizes.mjs";
import { SITE } from "./serve.mjs";

const [what, runs = "1"] = process.argv.slice(2);
const measures = { sizes: measuredSizes, parity, tours, "first-motion": firstMotions };
if (!(what in measures)) {
  console.error(`one of ${Object.keys(measures).join(", ")} was expected, got ${what ?? "nothing"}`);
  process.exit(2);
}
console.log(JSON.stringify(await measures[what]()));

function measuredSizes() {
  const files = sizes(SITE);
  return [{ part: "before the first motion", ...total(files.filter(({ first }) => first)) }, { part: "in all", ...total(files) }];
}

/** Largest differences from Python in every drive of every policy. */
async function parity() {
  const { compareEnd, compareSteps } = await import("./tests/compare.mjs");
  const { constants, makeRobot, readReference } = await import("./tests/load.mjs");
  const found = [];
  for (const policy of Object.keys(constants.policies)) {
    const robot = await makeRobot(policy);
    for (const [drive, given] of Object.entries(readReference(`drives_${policy}.json`))) {
      const { observation, action } = compareSteps(robot, given), { apartM } = compareEnd(robot, given);
      found.push({ policy, drive, seconds: given.actions.length / constants.control_hz, observation, action, apart_m: apartM });
    }
  }
  return found;
}

/** Verdicts on the operator's tours, the page's and Python's. */
async function tours() {
  const { driveTour } = await import("./tests/compare.mjs");
  const { makeRobot, readReference } = await import("./tests/load.mjs");
  const robot = await makeRobot();
  return readReference("tours.json").map((plan, tour) => {
    const { survivalS, fallen } = driveTour(robot, plan);
    return { tour, seconds: plan.seconds, fallen, survival_s: survivalS, fallen_in_python: plan.fallen };
  });
}

/** Seconds from asking for the page to the first picture of the moving robot, each with a new browser. */
async function firstMotions() {
  const { atFirstMotion } = await import("./first_motion.mjs");
  const { serve } = await import("./serve.mjs");
  const server = await serve(0), found = [];
  for (let run = 0; run < Number(runs); run++) found.push({ run, seconds: await atFirstMotion(server, (page, ms) => ms / 1000) });
  server.close();
  return found;
}
