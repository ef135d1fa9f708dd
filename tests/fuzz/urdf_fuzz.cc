// URDF: what is loaded has names to show, makes a model, and is
// read back from what is written of it.

#include <cmath>

#include "models/model.h"
#include "models/parameters.h"
#include "models/printable.h"
#include "models/urdf/load_urdf.h"
#include "models/urdf/write_urdf.h"
#include "tests/fuzz/fuzz.h"

namespace sysid {
namespace {

// Names stand in tables, in CSV and in JSON as they are.
void ExpectName(const std::string& name) {
  FUZZ_EXPECT(!name.empty() && IsUtf8(name));
  FUZZ_EXPECT(name.find('\n') == std::string::npos);
  ExpectPrintable(name);
}

void ExpectNames(const Mechanism& mechanism) {
  ExpectName(mechanism.name);
  for (const std::string& name : mechanism.LinkNames()) ExpectName(name);
  for (const Joint& joint : mechanism.joints) ExpectName(joint.name);
}

void ExpectSame(const Mechanism& before, const Mechanism& after) {
  FUZZ_EXPECT(after.name == before.name);
  FUZZ_EXPECT(after.LinkNames() == before.LinkNames());
  FUZZ_EXPECT(after.nq == before.nq && after.nv == before.nv);
  FUZZ_EXPECT(after.joints.size() == before.joints.size());
  for (size_t i = 0; i < before.joints.size(); ++i) {
    const Joint &a = before.joints[i], &b = after.joints[i];
    FUZZ_EXPECT(a.name == b.name && a.type == b.type);
    FUZZ_EXPECT(a.parent_link == b.parent_link && a.child_link == b.child_link);
    // By way of roll, pitch and yaw.
    FUZZ_EXPECT((a.R_PJ - b.R_PJ).cwiseAbs().maxCoeff() < 1e-14);
    if (a.type != JointType::kFixed && a.type != JointType::kSpherical) {
      FUZZ_EXPECT((a.axis - b.axis).cwiseAbs().maxCoeff() < 1e-15);
    }
    FUZZ_EXPECT(a.damping == b.damping && a.friction == b.friction);
    FUZZ_EXPECT(before.nominal.joint_p[i] == after.nominal.joint_p[i]);
  }
  // The root moves nothing: its inertial is not written.
  for (size_t i = 1; i < before.links.size(); ++i) {
    const Inertial<double>& a = before.nominal.links[i];
    const Inertial<double>& b = after.nominal.links[i];
    FUZZ_EXPECT(a.mass == b.mass);
    FUZZ_EXPECT(a.com == b.com);
    FUZZ_EXPECT(a.inertia == b.inertia);
  }
}

}  // namespace
}  // namespace sysid

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data,
                                      std::size_t size) {
  using namespace sysid;
  try {
    const Mechanism mechanism = LoadUrdfText(TextOf(data, size), "robot.urdf");
    FUZZ_EXPECT(mechanism.nv > 0);
    ExpectNames(mechanism);
    const Model model = MakeModel(mechanism, Catalogue());
    FUZZ_EXPECT(model.nv() == mechanism.nv);
    for (const Parameter& parameter : AllParameters(model)) {
      FUZZ_EXPECT(std::isfinite(parameter.nominal));
      FUZZ_EXPECT(parameter.typical_scale > 0);
    }
    std::string written = WriteUrdf(model);
    try {
      ExpectSame(mechanism, LoadUrdfText(written, "written.urdf"));
    } catch (const InputError& error) {
      std::fprintf(stderr, "%s\n%s\n", written.c_str(), error.what());
      FUZZ_EXPECT(!"what was written is refused");
    }
  } catch (const InputError& error) {
    ExpectReadable(error);
  }
  return 0;
}
