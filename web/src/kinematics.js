/** Where the feet are and how fast they move, by the joints alone: `go1_mtl_gym.kinematics`. */

/**
 * Where the feet are, and what each says of the trunk's velocity if it stands still: -(J dq + omega x p).
 *
 * @param q joint positions [rad], 12.
 * @param dq joint speeds [rad/s], 12.
 * @param omega angular velocity of the trunk in its frame [rad/s], 3.
 * @param robot the constants "robot".
 * @returns 24 numbers: positions 4 x 3 [m], then velocities 4 x 3 [m/s], trunk frame.
 */
export function legKinematics(q, dq, omega, robot) {
  const out = new Float64Array(24);
  for (let leg = 0; leg < 4; leg++) {
    const [hip, thigh, calf] = [q[3 * leg], q[3 * leg + 1], q[3 * leg + 2]];
    const [hipSpeed, thighSpeed, calfSpeed] = [dq[3 * leg], dq[3 * leg + 1], dq[3 * leg + 2]];
    const cos = Math.cos(hip), sin = Math.sin(hip);
    // In the thigh's plane: forward is x, down is -z of the trunk turned by the hip about x.
    const calfForward = -robot.calf_length * Math.sin(thigh + calf);
    const calfDown = robot.calf_length * Math.cos(thigh + calf);
    const legForward = calfForward - robot.thigh_length * Math.sin(thigh);
    const legDown = calfDown + robot.thigh_length * Math.cos(thigh);
    const sideways = robot.leg_side[leg] * robot.hip_to_thigh;
    const fromHip = [legForward, sideways * cos + legDown * sin, sideways * sin - legDown * cos];
    // Thigh and calf turn about (0, cos, sin): v = omega (0, cos, sin) x r.
    const forward = calfSpeed * calfForward + thighSpeed * legForward;
    const down = -(calfSpeed * calfDown + thighSpeed * legDown);
    const [vx, vy, vz] = [down, -hipSpeed * fromHip[2] + sin * forward, hipSpeed * fromHip[1] - cos * forward];
    const [x, y, z] = fromHip.map((value, i) => robot.hip_position_b[leg][i] + value);
    out.set([x, y, z], 3 * leg);
    out.set(
      [
        -(vx + omega[1] * z - omega[2] * y),
        -(vy + omega[2] * x - omega[0] * z),
        -(vz + omega[0] * y - omega[1] * x),
      ],
      12 + 3 * leg,
    );
  }
  return out;
}
