#pragma once

namespace sysid {

// What sysid_simulate --help prints. A test compares its effects with the
// catalogue.
inline constexpr char kHelp[] =
    R"(sysid_simulate: make a recording from a model

  sysid_simulate --model pendulum2 --set link1.length=0.81,link2.length=0.304
      --add viscous_damping@joint1=0.02 --noise 1e-3 --out_csv run.csv

  --model NAME|FILE.urdf     a shipped model (pendulum1..3, pendulum2_planar,
                             pendulum3_planar, cartpole, arm7) or a URDF
  --lock 'wheel_*,head=0.3'  joints held still
  --set name=value,...       parameters, also those of effects
  --add effect@target=v,...  effects, with the value of their first parameter;
                             names may be patterns: 'viscous_damping@*=0.1'
      on joints: viscous_damping, cubic_damping, quadratic_drag,
          coulomb_friction, stribeck_friction, asymmetric_friction,
          load_friction, load_stribeck_friction, thermal_friction,
          presliding_friction, gear_efficiency, spring, backlash,
          joint_elasticity, armature, cogging, transmission_error,
          effort_bias, effort_gain, effort_limit, actuator_lag,
          position_drive, sensor_offset, sensor_gain, sensor_delay,
          force_table, 'custom@J: FORMULA'
      on pairs:  gear_coupling@A+B
      on links:  aerodynamic_drag, mass, com, inertia
      on base:   effort_delay, gravity_tilt, base_motion
  --initial random|RUN.csv   start at rest at random angles, or as the first
                             row of a run (velocities where it has them)
  --tilt 0.6                 largest angle of a random start, rad (slides: m)
  --excite none|multisine    drive the joints of one degree of freedom: those
                             with limits within them, the others by efforts
    --amplitude 1  --band 0.1,2    part of the room, frequencies in Hz
  --efforts FILE.csv         apply the efforts J.tau of a file instead
  --track REFERENCE.csv --gains kp,kd    or follow the positions J.q of a file,
                             tau = kp (q_ref - q) + kd (qd_ref - qd), within
                             the effort limits (--gains joint1=200:20,...)
  --inputs FILE.csv          what effects read: J.cmd, J.temperature, base.ax
  --duration 10  --rate 100  s, Hz
  --noise 1e-3               of a measurement, rad or m
  --motor_sensors            also record motors, J.motor_q (joint_elasticity)
  --seed 1                   every random draw derives from it
  --integrator rk4|semi_implicit_euler|ros2  --step S (default: fine enough)
  --out_csv run.csv          the run; - is standard output
Exit code: 0 done, 2 bad input.
)";

}  // namespace sysid
