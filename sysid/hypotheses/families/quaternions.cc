// Quaternions written in another order, or those of the inverse rotation.

#include <array>

#include "sysid/hypotheses/families/families.h"

namespace sysid {
namespace {

// What stands in our columns qw, qx, qy, qz.
constexpr std::array<const char*, 4> kSuffixes = {".qw", ".qx", ".qy", ".qz"};

struct Spelling {
  DataFault fault;
  const char* says;
  std::array<int, 4> from;  // our w, x, y, z are these columns of ours
  std::array<int, 4> signs;
};

constexpr Spelling kOrders[] = {
    {DataFault::kQuaternionOrder,
     "as x, y, z, w instead of w, x, y, z",
     {3, 0, 1, 2},
     {1, 1, 1, 1}},
    {DataFault::kQuaternionOrder,
     "as w, x, y, z that was renamed to x, y, z, w",
     {1, 2, 3, 0},
     {1, 1, 1, 1}},
    {DataFault::kQuaternionInverse,
     "as the inverse rotation (parent to child)",
     {0, 1, 2, 3},
     {1, -1, -1, -1}},
    {DataFault::kQuaternionInverse,
     "as x, y, z, w of the inverse rotation",
     {3, 0, 1, 2},
     {1, -1, -1, -1}},
};

}  // namespace

void QuaternionOrders(const CheckInput& input,
                      std::vector<DataHypothesis>* all) {
  const Mechanism* mechanism = &input.model->mechanism();
  std::vector<int> balls;
  for (size_t j = 0; j < mechanism->joints.size(); ++j) {
    if (Measures(input, ChannelKind::kOrientation, static_cast<int>(j))) {
      balls.push_back(static_cast<int>(j));
    }
  }
  const auto add = [&](const std::vector<int>& joints, const Spelling& order) {
    DataHypothesis hypothesis;
    hypothesis.fault = order.fault;
    std::string names;
    for (const int j : joints) {
      hypothesis.subjects.push_back(mechanism->joints[j].name + ".qw");
      names += (names.empty() ? "" : ", ") + mechanism->joints[j].name;
    }
    hypothesis.says =
        Words("with the quaternion of " + names + " read " + order.says);
    hypothesis.consequence =
        "what is read is a valid but different rotation: no error reveals it";
    hypothesis.corrected = [=](double) {
      std::vector<CorrectedColumn> columns;
      for (const int j : joints) {
        const std::string& name = mechanism->joints[j].name;
        for (int i = 0; i < 4; ++i) {
          columns.push_back({name + kSuffixes[i],
                             {{static_cast<double>(order.signs[i]),
                               name + kSuffixes[order.from[i]]}}});
        }
      }
      return columns;
    };
    all->push_back(hypothesis);
  };
  for (const Spelling& order : kOrders) {
    if (balls.size() > 1) add(balls, order);
    for (const int ball : balls) add({ball}, order);
  }
}

}  // namespace sysid
