#pragma once

#include "models/effects/aerodynamic_drag.h"
#include "models/effects/armature.h"
#include "models/effects/cogging.h"
#include "models/effects/com.h"
#include "models/effects/coulomb_friction.h"
#include "models/effects/effort_bias.h"
#include "models/effects/effort_delay.h"
#include "models/effects/effort_gain.h"
#include "models/effects/gravity_tilt.h"
#include "models/effects/inertia.h"
#include "models/effects/mass.h"
#include "models/effects/quadratic_drag.h"
#include "models/effects/sensor_offset.h"
#include "models/effects/spring.h"
#include "models/effects/stribeck_friction.h"
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
    Cogging>;

}  // namespace sysid
