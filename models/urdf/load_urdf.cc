#include "models/urdf/load_urdf.h"

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <functional>
#include <queue>
#include <set>

#include "models/error.h"
#include "models/urdf/urdf_outline.h"
#include "models/urdf/urdf_xml.h"

namespace sysid {
namespace {

std::string Quoted(const std::string& name) { return "'" + name + "'"; }

std::vector<std::vector<int>> JointsByParent(const UrdfOutline& outline) {
  std::vector<std::vector<int>> joints(outline.links.size());
  for (size_t i = 0; i < outline.joints.size(); ++i) {
    const int parent = outline.joints[i].parent_link;
    if (parent >= 0) joints[parent].push_back(static_cast<int>(i));
  }
  return joints;
}

// The joint that carries each link, -1 for roots. Links with two are faults.
std::vector<int> CarryingJoints(const UrdfOutline& outline,
                                UrdfFaults* faults) {
  std::vector<int> carriers(outline.links.size(), -1);
  for (size_t i = 0; i < outline.joints.size(); ++i) {
    const UrdfJoint& joint = outline.joints[i];
    if (joint.child_link < 0) continue;
    int& carrier = carriers[joint.child_link];
    if (carrier < 0) {
      carrier = static_cast<int>(i);
      continue;
    }
    const UrdfJoint& first = outline.joints[carrier];
    faults->Add(joint.row, joint.column,
                "joint " + Quoted(joint.name) + ": closes a loop: its child " +
                    Quoted(outline.links[joint.child_link].name) +
                    " is already carried by joint " + Quoted(first.name) +
                    " (line " + std::to_string(first.row) + ")",
                "a URDF is a tree: leave out one joint of every loop");
  }
  return carriers;
}

// The links that are reached from `first` by joints that `may_pass`, but for
// those that were `reached` before.
template <typename MayPass>
std::vector<int> Walk(const UrdfOutline& outline, int first,
                      const MayPass& may_pass, std::vector<bool>* reached) {
  const std::vector<std::vector<int>> joints = JointsByParent(outline);
  std::vector<int> found, stack = {first};
  while (!stack.empty()) {
    const int link = stack.back();
    stack.pop_back();
    if ((*reached)[link]) continue;  // a loop, or met before
    (*reached)[link] = true;
    found.push_back(link);
    for (int j : joints[link]) {
      const UrdfJoint& joint = outline.joints[j];
      if (joint.child_link >= 0 && may_pass(joint)) {
        stack.push_back(joint.child_link);
      }
    }
  }
  return found;
}

// Links that no walk from `root` reaches, although each has a parent.
void CheckCycles(const UrdfOutline& outline, const std::vector<int>& roots,
                 const std::vector<int>& carriers, UrdfFaults* faults) {
  std::vector<bool> reached(outline.links.size(), false);
  const auto walk = [&](int from) {
    Walk(
        outline, from, [](const UrdfJoint&) { return true; }, &reached);
  };
  for (int root : roots) walk(root);
  for (size_t start = 0; start < outline.links.size(); ++start) {
    if (reached[start] || carriers[start] < 0) continue;
    // Up the parents: the first link met again is on the cycle.
    std::vector<bool> met(outline.links.size(), false);
    int link = static_cast<int>(start);
    while (!met[link]) {
      met[link] = true;
      link = outline.joints[carriers[link]].parent_link;
    }
    std::vector<std::string> names;
    int at = link;
    do {
      names.insert(names.begin(), Quoted(outline.links[at].name));
      at = outline.joints[carriers[at]].parent_link;
    } while (at != link);
    faults->Add(
        outline.links[link].row, outline.links[link].column,
        "a loop without a root: link" +
            std::string(names.size() > 1 ? "s " : " ") + Join(names) +
            (names.size() > 1 ? " carry each other" : " carries itself"),
        "a URDF is a tree: leave out one joint of every loop");
    walk(link);
  }
}

void CheckRoots(const UrdfOutline& outline, const std::vector<int>& roots,
                UrdfFaults* faults) {
  if (roots.size() < 2) return;
  std::vector<std::string> names;
  for (int root : roots) names.push_back(Quoted(outline.links[root].name));
  const UrdfLink& second = outline.links[roots[1]];
  faults->Add(second.row, second.column,
              std::to_string(roots.size()) + " root links: " + Join(names),
              "only one link may be without a parent: join the others to it, "
              "by fixed joints for example");
}

// The masses of everything that moves as one with link `first`. NaN where one
// is at fault already.
double MassOfBody(const UrdfOutline& outline, int first) {
  std::vector<bool> reached(outline.links.size(), false);
  const auto is_fixed = [](const UrdfJoint& joint) {
    return joint.type == JointType::kFixed;
  };
  double mass = 0;
  for (int link : Walk(outline, first, is_fixed, &reached)) {
    mass += outline.links[link].body.mass;
  }
  return mass;
}

void CheckMovingMasses(const UrdfOutline& outline, UrdfFaults* faults) {
  for (const UrdfJoint& joint : outline.joints) {
    if (joint.type == JointType::kFixed || joint.child_link < 0) continue;
    const UrdfLink& link = outline.links[joint.child_link];
    if (link.body.mass < 0) continue;  // noted already
    if (MassOfBody(outline, joint.child_link) != 0) continue;
    faults->Add(link.row, link.column,
                "link " + Quoted(link.name) +
                    (link.has_inertial ? ": the mass is zero"
                                       : ": no mass (no <inertial>)") +
                    ", but joint " + Quoted(joint.name) + " moves it",
                "give it a mass, or make the joint fixed");
  }
}

// Checks that the joints make a tree on one root, that something moves and that
// every moving body has a mass; sets outline->root.
void CheckTree(UrdfOutline* outline, UrdfFaults* faults) {
  bool moves = false;
  bool ends_known = true;
  for (const UrdfJoint& joint : outline->joints) {
    moves |= !joint.type_known || joint.type != JointType::kFixed;
    ends_known &= joint.parent_link >= 0 && joint.child_link >= 0;
  }
  if (!moves && !outline->links.empty()) {
    faults->Add(0, 0, "no moving joint: there is nothing to identify",
                "joints are revolute, continuous, prismatic or spherical");
  }
  const std::vector<int> carriers = CarryingJoints(*outline, faults);
  CheckMovingMasses(*outline, faults);
  // A joint without a known end may be the one that makes this a tree.
  if (!ends_known || outline->links.empty()) return;
  std::vector<int> roots;
  std::set<std::string> names;
  for (size_t i = 0; i < outline->links.size(); ++i) {
    // No joint finds a link without a name of its own, which is noted already:
    // that it has no parent follows.
    const std::string& name = outline->links[i].name;
    const bool findable = !name.empty() && names.insert(name).second;
    if (carriers[i] < 0 && findable) roots.push_back(static_cast<int>(i));
  }
  CheckRoots(*outline, roots, faults);
  CheckCycles(*outline, roots, carriers, faults);
  if (roots.size() == 1) outline->root = roots[0];
}

// The joints with parents before children, else in the order of the file.
// `outline` is a tree.
std::vector<int> ParentsFirst(const UrdfOutline& outline) {
  const std::vector<std::vector<int>> joints = JointsByParent(outline);
  std::priority_queue<int, std::vector<int>, std::greater<int>> ready;
  for (int j : joints[outline.root]) ready.push(j);
  std::vector<int> order;
  while (!ready.empty()) {
    const int next = ready.top();
    ready.pop();
    order.push_back(next);
    for (int j : joints[outline.joints[next].child_link]) ready.push(j);
  }
  return order;
}

}  // namespace

Mechanism LoadUrdf(const std::string& path) {
  constexpr size_t kMostText = size_t{64} << 20;
  std::error_code ignored;
  if (std::filesystem::is_directory(path, ignored)) {
    throw InputError(path, "is a folder, not a URDF file", "name a file in it");
  }
  std::ifstream file(path, std::ios::binary);
  if (!file) {
    throw InputError(path,
                     std::string("cannot be read: ") + std::strerror(errno),
                     "give a URDF file or the name of a shipped model");
  }
  std::string text;
  std::vector<char> chunk(1 << 16);
  // Text has no NUL: stops there, for /dev/zero has no end.
  for (size_t read = 0; file && text.find('\0', read) == std::string::npos;) {
    read = text.size();
    if (read > kMostText) {
      throw InputError(path, "is larger than 64 MiB",
                       "is this the URDF that you mean? Meshes stand in files "
                       "of their own");
    }
    file.read(chunk.data(), static_cast<std::streamsize>(chunk.size()));
    text.append(chunk.data(), static_cast<size_t>(file.gcount()));
  }
  return LoadUrdfText(text, path);
}

Mechanism LoadUrdfText(const std::string& text, const std::string& path) {
  UrdfFaults faults(path);
  UrdfOutline outline = ReadUrdfOutline(text, path, &faults);
  CheckTree(&outline, &faults);
  faults.Throw();
  const std::vector<UrdfLink>& links = outline.links;
  Mechanism mechanism;
  mechanism.name = outline.robot_name;
  std::vector<int> index(links.size(), -1);  // of the outline's links
  index[outline.root] = mechanism.AddRoot(links[outline.root].name);
  mechanism.nominal.links[0] = links[outline.root].body;
  for (int j : ParentsFirst(outline)) {
    const UrdfJoint& read = outline.joints[j];
    const UrdfLink& child = links[read.child_link];
    Joint joint = read;
    joint.parent_link = index[read.parent_link];
    const int added =
        mechanism.AddJoint(joint, child.name, read.p_PJ, child.body);
    index[read.child_link] = mechanism.joints[added].child_link;
  }
  return mechanism;
}

}  // namespace sysid
