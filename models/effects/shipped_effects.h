#pragma once

#include "models/effects/actuator_lag.h"
#include "models/effects/aerodynamic_drag.h"
#include "models/effects/armature.h"
#include "models/effects/asymmetric_friction.h"
#include "models/effects/backlash.h"
#include "models/effects/base_motion.h"
#include "models/effects/cogging.h"
#include "models/effects/com.h"
#include "models/effects/coulomb_friction.h"
#include "models/effects/cubic_damping.h"
#include "models/effects/custom_law.h"
#include "models/effects/effort_bias.h"
#include "models/effects/effort_delay.h"
#include "models/effects/effort_gain.h"
#include "models/effects/effort_limit.h"
#include "models/effects/force_table.h"
#include "models/effects/gear_coupling.h"
#include "models/effects/gravity_tilt.h"
#include "models/effects/inertia.h"
#include "models/effects/joint_elasticity.h"
#include "models/effects/load_friction.h"
#include "models/effects/mass.h"
#include "models/effects/position_drive.h"
#include "models/effects/presliding_friction.h"
#include "models/effects/quadratic_drag.h"
#include "models/effects/sensor_delay.h"
#include "models/effects/sensor_gain.h"
#include "models/effects/sensor_offset.h"
#include "models/effects/spring.h"
#include "models/effects/stribeck_friction.h"
#include "models/effects/thermal_friction.h"
#include "models/effects/transmission_error.h"
#include "models/effects/viscous_damping.h"

namespace sysid {

template <class... Effects>
struct EffectList {};

// Every effect that the toolkit ships. One line an effect, from the common to
// the rare: of two that explain the same, a diagnosis takes the first.
using ShippedEffects = EffectList<  //
    ViscousDamping,                 //
    CoulombFriction,                //
    EffortBias,                     //
    EffortGain,                     //
    Armature,                       //
    GravityTilt,                    //
    SensorOffset,                   //
    QuadraticDrag,                  //
    StribeckFriction,               //
    Spring,                         //
    EffortDelay,                    //
    AerodynamicDrag,                //
    WrongMass,                      //
    WrongCom,                       //
    WrongInertia,                   //
    Cogging,                        //
    PositionDrive,                  //
    BaseMotion,                     //
    LoadFriction,                   //
    GearCoupling,                   //
    CubicDamping,                   //
    ThermalFriction,                //
    ActuatorLag,                    //
    EffortLimit,                    //
    SensorGain,                     //
    SensorDelay,                    //
    TransmissionError,              //
    AsymmetricFriction,             //
    LoadStribeckFriction,           //
    GearEfficiency,                 //
    PreslidingFriction,             //
    JointElasticity,                //
    Backlash,                       //
    ForceTable,                     //
    CustomLaw>;

}  // namespace sysid
