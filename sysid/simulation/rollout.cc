#include "sysid/simulation/rollout.h"

#include <utility>

#include "models/error.h"
#include "models/parameters.h"
#include "residuals/segment_tangent.h"

namespace sysid {
namespace {

constexpr char kPlace[] = "rollout";

void CheckDrive(const Model& model, const Eigen::VectorXd& x0,
                const Run& drive) {
  const auto check = [](bool right, const std::string& what,
                        const std::string& hint) {
    if (!right) throw InputError(kPlace, what, hint);
  };
  check(x0.size() == model.state_size() && x0.allFinite(),
        "the start has " + std::to_string(x0.size()) + " numbers, not " +
            std::to_string(model.state_size()) + " finite ones",
        "give q, qd and the internal states: Model::layout()");
  check(drive.size() >= 2, "the drive has fewer than two times",
        "give the times at which states are wanted, in seconds");
  for (int k = 1; k < drive.size(); ++k) {
    check(drive.t[k] > drive.t[k - 1],
          "the time does not rise at sample " + std::to_string(k),
          "each time is later than the one before");
  }
  check(drive.effort.rows() == drive.size() &&
            drive.effort.cols() == model.nv() && drive.effort.allFinite(),
        "the efforts are " + std::to_string(drive.effort.rows()) + " x " +
            std::to_string(drive.effort.cols()) + ", not " +
            std::to_string(drive.size()) + " x " + std::to_string(model.nv()) +
            " finite numbers",
        "give a row for each time, a column for each of qd");
  const EffectSet& effects = model.effects();
  for (int i = 0; i < effects.size(); ++i) {
    for (const EffectInput& input : effects.effect(i).inputs()) {
      check(HasInput(drive, input.name),
            effects.effect(i).name() + " reads " + input.name +
                ", which the drive does not have",
            "put it among the drive's inputs");
    }
  }
  for (const Input& input : drive.inputs) {
    check(static_cast<int>(input.values.size()) == drive.size(),
          "input '" + input.name + "' has " +
              std::to_string(input.values.size()) + " values, not " +
              std::to_string(drive.size()),
          "give one for each time");
  }
}

[[noreturn]] void FailNotFinite() {
  throw InputError(kPlace, "the motion does not stay finite",
                   "check masses and efforts, or take smaller steps");
}

// The drive as something that was measured, in which nothing was.
struct Unmeasured {
  explicit Unmeasured(const Run& drive) : run(drive) {
    run.channels.clear();
    measurements.run = &run;
  }
  Unmeasured(const Unmeasured&) = delete;
  Run run;
  Measurements measurements;
};

}  // namespace

RowMatrixXd RollOut(const Model& model, const Eigen::VectorXd& x0,
                    const Run& drive, const RolloutOptions& options) {
  CheckDrive(model, x0, drive);
  const Unmeasured unmeasured(drive);
  const ParameterMap nothing(model, {});
  const SegmentRollout rollout(&model, &nothing, &unmeasured.measurements, 0,
                               drive.size() - 1, options);
  Eigen::VectorXd end(model.state_size());
  std::vector<double> states;
  if (!rollout(x0.data(), static_cast<const double*>(nullptr),
               static_cast<double*>(nullptr), end.data(), &states)) {
    FailNotFinite();
  }
  const RowMatrixXd result = Eigen::Map<const RowMatrixXd>(
      states.data(), drive.size(), model.state_size());
  if (!result.allFinite()) FailNotFinite();
  return result;
}

RowMatrixXd LinearizedRollout::ByEffort(int k, int j) const {
  if (k <= j) return RowMatrixXd::Zero(B[j].rows(), B[j].cols());
  RowMatrixXd moved = B[j];
  for (int i = j + 1; i < k; ++i) moved = A[i] * moved;
  return moved;
}

LinearizedRollout LinearizeRollout(const Model& model,
                                   const std::vector<std::string>& parameters,
                                   const Eigen::VectorXd& x0, const Run& drive,
                                   const RolloutOptions& options) {
  CheckDrive(model, x0, drive);
  const Unmeasured unmeasured(drive);
  // By the values themselves.
  const ParameterMap map(model, FindParameters(model, parameters, kPlace),
                         false);
  Eigen::VectorXd values(map.size());
  for (int i = 0; i < map.size(); ++i) values[i] = map.parameters()[i].nominal;
  const int last = drive.size() - 1, n = model.tangent_size();
  const SegmentRollout whole(&model, &map, &unmeasured.measurements, 0, last,
                             options);
  SegmentTangent tangent;
  if (!LinearizeAlong(whole, x0.data(), values.data(), &tangent)) {
    FailNotFinite();
  }
  LinearizedRollout result;
  result.states = tangent.states;
  result.A = std::move(tangent.A);
  result.B = std::move(tangent.B);
  result.by_start.push_back(RowMatrixXd::Identity(n, n));
  result.by_parameters.push_back(RowMatrixXd::Zero(n, map.size()));
  SegmentScratch scratch;
  Eigen::VectorXd end(model.state_size());
  RowMatrixXd of_errors;
  for (int k = 0; k < last; ++k) {
    const SegmentRollout step(&model, &map, &unmeasured.measurements, k, k + 1,
                              options);
    RowMatrixXd P;
    if (!step.LinearizeByTheta(result.states.row(k).data(), values.data(),
                               nullptr, end.data(), &of_errors, &P, &scratch) ||
        !result.A[k].allFinite() || !result.B[k].allFinite()) {
      FailNotFinite();
    }
    result.by_start.push_back(result.A[k] * result.by_start[k]);
    result.by_parameters.push_back(result.A[k] * result.by_parameters[k] + P);
    result.P.push_back(std::move(P));
  }
  return result;
}

}  // namespace sysid
