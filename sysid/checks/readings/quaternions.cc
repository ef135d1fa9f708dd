// Quaternions written in another order, or those of the inverse rotation.

#include <array>

#include "sysid/checks/readings/edit_run.h"
#include "sysid/checks/remedy.h"
#include "sysid/checks/shipped_checks.h"

namespace sysid {
namespace {

// What stands in our columns qw, qx, qy, qz.
constexpr std::array<const char*, 4> kSuffixes = {".qw", ".qx", ".qy", ".qz"};

struct Spelling {
  const char* fault;
  const char* says;
  std::array<int, 4> from;  // our w, x, y, z are these columns of ours
  std::array<int, 4> signs;
};

constexpr Spelling kOrders[] = {
    {"quaternion_order",
     "as x, y, z, w instead of w, x, y, z",
     {3, 0, 1, 2},
     {1, 1, 1, 1}},
    {"quaternion_order",
     "as w, x, y, z that was renamed to x, y, z, w",
     {1, 2, 3, 0},
     {1, 1, 1, 1}},
    {"quaternion_inverse",
     "as the inverse rotation (parent to child)",
     {0, 1, 2, 3},
     {1, -1, -1, -1}},
    {"quaternion_inverse",
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

void ReadQuaternions(const CheckInput& input, std::vector<Reading>* readings) {
  const Mechanism& mechanism = input.model->mechanism();
  std::vector<int> balls;
  for (size_t j = 0; j < mechanism.joints.size(); ++j) {
    if (Measures(input, ChannelKind::kOrientation, static_cast<int>(j))) {
      balls.push_back(static_cast<int>(j));
    }
  }
  const auto add = [&](const std::vector<int>& joints, const Spelling& order) {
    NewColumns columns;
    std::string names;
    for (const int j : joints) {
      const std::string& name = mechanism.joints[j].name;
      names += (names.empty() ? "" : ", ") + name;
      for (int i = 0; i < 4; ++i) {
        const std::string from =
            SourceOf(input, name + kSuffixes[order.from[i]]);
        const std::string to = order.signs[i] < 0 ? Negated(from) : from;
        if (to == name + kSuffixes[i]) continue;
        columns.push_back({name + kSuffixes[i], to});
      }
    }
    Reading reading;
    reading.fault = order.fault;
    reading.subject = names + (joints.size() == 1 ? ".qw" : "");
    reading.says = "with the quaternion of " + names + " read " + order.says;
    reading.consequence =
        "what is read is a rotation too, but another one: nothing warns of it";
    reading.change = [joints, order](Run* run) {
      for (const int j : joints) {
        Channel* channel = ChannelOf(run, ChannelKind::kOrientation, j);
        if (channel != nullptr) Reorder(order, channel);
      }
    };
    reading.remedies = {ColumnsFlag(input, columns)};
    readings->push_back(reading);
  };
  for (const Spelling& order : kOrders) {
    if (balls.size() > 1) add(balls, order);
    for (const int ball : balls) add({ball}, order);
  }
}

}  // namespace sysid
