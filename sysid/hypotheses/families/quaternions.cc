// Quaternions written in another order, or those of the inverse rotation.

#include <array>

#include "sysid/checks/edit_run.h"
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

void Reorder(const Spelling& order, Channel* channel) {
  constexpr int kSlot[4] = {3, 0, 1, 2};  // of w, x, y, z in memory
  const RowMatrixXd was = channel->values;
  for (int i = 0; i < 4; ++i) {
    channel->values.col(kSlot[i]) =
        order.signs[i] * was.col(kSlot[order.from[i]]);
  }
}

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
        "what is read is a rotation too, but another one: nothing warns of it";
    hypothesis.change = [joints, order](double, Run* run) {
      for (const int j : joints) {
        Channel* channel = FindChannel(run, ChannelKind::kOrientation, j);
        if (channel != nullptr) Reorder(order, channel);
      }
    };
    hypothesis.fix = [=](const CheckInput& of_run, double) {
      SuggestedFix fix;
      for (const int j : joints) {
        const std::string& name = mechanism->joints[j].name;
        for (int i = 0; i < 4; ++i) {
          const std::string from =
              SourceOf(of_run, name + kSuffixes[order.from[i]]);
          const std::string to = order.signs[i] < 0 ? Negated(from) : from;
          if (to == name + kSuffixes[i]) continue;
          fix.columns.push_back({name + kSuffixes[i], to});
        }
      }
      return fix;
    };
    all->push_back(hypothesis);
  };
  for (const Spelling& order : kOrders) {
    if (balls.size() > 1) add(balls, order);
    for (const int ball : balls) add({ball}, order);
  }
}

}  // namespace sysid
