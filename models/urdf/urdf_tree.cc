#include "models/urdf/urdf_tree.h"

#include <functional>
#include <queue>
#include <set>

#include "models/error.h"

namespace sysid {
namespace {

std::string Quoted(const std::string& name) { return "'" + name + "'"; }

std::vector<std::vector<int>> JointsByParent(const UrdfOutline& outline) {
  std::vector<std::vector<int>> joints(outline.links.size());
  for (size_t i = 0; i < outline.joints.size(); ++i) {
    const int parent = outline.joints[i].parent;
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
    if (joint.child < 0) continue;
    int& carrier = carriers[joint.child];
    if (carrier < 0) {
      carrier = static_cast<int>(i);
      continue;
    }
    const UrdfJoint& first = outline.joints[carrier];
    faults->Add(joint.row, joint.column,
                "joint " + Quoted(joint.name) + ": closes a loop: its child " +
                    Quoted(outline.links[joint.child].name) +
                    " is already carried by joint " + Quoted(first.name) +
                    " (line " + std::to_string(first.row) + ")",
                "a URDF is a tree: leave out one joint of every loop");
  }
  return carriers;
}

// Links that no walk from `root` reaches, although each has a parent.
void CheckCycles(const UrdfOutline& outline, const std::vector<int>& roots,
                 const std::vector<int>& carriers, UrdfFaults* faults) {
  const std::vector<std::vector<int>> joints = JointsByParent(outline);
  std::vector<bool> reached(outline.links.size(), false);
  const auto walk = [&](int from) {
    std::vector<int> stack = {from};
    while (!stack.empty()) {
      const int link = stack.back();
      stack.pop_back();
      if (reached[link]) continue;
      reached[link] = true;
      for (int j : joints[link]) {
        if (outline.joints[j].child >= 0) {
          stack.push_back(outline.joints[j].child);
        }
      }
    }
  };
  for (int root : roots) walk(root);
  for (size_t start = 0; start < outline.links.size(); ++start) {
    if (reached[start] || carriers[start] < 0) continue;
    // Up the parents: the first link met again is on the cycle.
    std::vector<bool> met(outline.links.size(), false);
    int link = static_cast<int>(start);
    while (!met[link]) {
      met[link] = true;
      link = outline.joints[carriers[link]].parent;
    }
    std::vector<std::string> names;
    int at = link;
    do {
      names.insert(names.begin(), Quoted(outline.links[at].name));
      at = outline.joints[carriers[at]].parent;
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

}  // namespace

void CheckTree(UrdfOutline* outline, UrdfFaults* faults) {
  std::set<std::string> joints;
  for (const UrdfJoint& joint : outline->joints) joints.insert(joint.name);
  bool moves = false;
  bool ends_known = true;
  for (const UrdfJoint& joint : outline->joints) {
    const bool follows = joint.mimic && joints.count(joint.mimic->joint) > 0;
    moves |= !joint.type_known || (joint.type != JointType::kFixed && !follows);
    ends_known &= joint.parent >= 0 && joint.child >= 0;
  }
  if (!moves && !outline->links.empty()) {
    faults->Add(0, 0, "no moving joint: there is nothing to identify",
                "joints are revolute, continuous, prismatic or spherical");
  }
  const std::vector<int> carriers = CarryingJoints(*outline, faults);
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

std::vector<int> ParentsFirst(const UrdfOutline& outline) {
  const std::vector<std::vector<int>> joints = JointsByParent(outline);
  std::priority_queue<int, std::vector<int>, std::greater<int>> ready;
  for (int j : joints[outline.root]) ready.push(j);
  std::vector<int> order;
  while (!ready.empty()) {
    const int next = ready.top();
    ready.pop();
    order.push_back(next);
    for (int j : joints[outline.joints[next].child]) ready.push(j);
  }
  return order;
}

}  // namespace sysid
