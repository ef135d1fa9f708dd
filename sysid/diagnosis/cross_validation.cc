#include "sysid/diagnosis/cross_validation.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <string>

#include "glog/logging.h"
#include "models/math/decompositions.h"
#include "sysid/diagnosis/comparison.h"
#include "sysid/diagnosis/judgement_constants.h"

namespace sysid {
namespace {

// Stretches in all: enough for a standard error to be known to a sixth.
constexpr int kStretches = 20;

using Stretch = CrossValidation::Stretch;

ErrorDifference FromNoise(const CrossValidation& all) {
  const Eigen::ArrayXd logs = all.LogErrors();
  return DifferenceOf(logs, Eigen::ArrayXd::Zero(logs.size()));
}

// The stretches of runs in order, about as long each, one at least a run; they
// do not depend on how the runs are cut into segments.
class StretchGrid {
 public:
  explicit StretchGrid(const DataSet& data) {
    double all = 0.0;
    for (const auto& run : data.runs()) all += Duration(*run);
    for (const auto& run : data.runs()) {
      const double part = kStretches * Duration(*run) / all;
      runs_.push_back({size_, std::max(1, static_cast<int>(std::lround(part))),
                       run->run.t.front(), Duration(*run), run->run.name});
      size_ += runs_.back().parts;
    }
  }
  // The stretches, still empty.
  void AddTo(std::vector<Stretch>* stretches) const {
    for (const Part& run : runs_) {
      for (int k = 0; k < run.parts; ++k) {
        const double length = run.duration / run.parts;
        stretches->push_back({0.0, 0.0, run.name, run.begin + k * length,
                              run.begin + (k + 1) * length});
      }
    }
  }
  int size() const { return size_; }
  int At(int run, double t) const {
    const Part& at = runs_[run];
    const int k = static_cast<int>(at.parts * (t - at.begin) / at.duration);
    return at.first + std::clamp(k, 0, at.parts - 1);
  }

 private:
  struct Part {
    int first, parts;
    double begin, duration;
    std::string name;
  };
  static double Duration(const RunData& data) {
    return data.run.t.back() - data.run.t.front();
  }

  int size_ = 0;
  std::vector<Part> runs_;
};

}  // namespace

double CrossValidation::Stretch::error() const {
  return dof > 0.0 ? std::sqrt(squares / dof)
                   : std::numeric_limits<double>::quiet_NaN();
}

Eigen::ArrayXd CrossValidation::LogErrors() const {
  Eigen::ArrayXd logs(stretches.size());
  for (size_t j = 0; j < stretches.size(); ++j) {
    logs[j] = std::log(stretches[j].error());
  }
  return logs;
}

double CrossValidation::error() const {
  return std::exp(FromNoise(*this).mean);
}

double CrossValidation::std_error() const {
  return error() * FromNoise(*this).std_error;
}

Folds FoldsOf(const LinearizedFit& fit) {
  const ShootingProblem& problem = fit.problem();
  const StretchGrid grid(problem.data());
  // With other runs, those alone give the parameters.
  const bool by_run = problem.runs().size() > 1;
  Folds folds;
  for (const auto& segment : fit.segments()) {
    const std::vector<double>& t = problem.runs()[segment->run]->run.t;
    const std::vector<int>& samples = fit.point().runs[segment->run].samples;
    const double middle =
        0.5 * (t[samples[segment->index]] + t[samples[segment->index + 1]]);
    folds.stretch.push_back(grid.At(segment->run, middle));
    folds.fold.push_back(by_run ? segment->run : folds.stretch.back());
  }
  folds.stretches = grid.size();
  folds.count = by_run ? static_cast<int>(problem.runs().size()) : grid.size();
  return folds;
}

CrossValidation CrossValidate(const LinearizedFit& fit) {
  const auto& segments = fit.segments();
  const double state_dof = ObservedStateDof(fit.problem());
  const int count = static_cast<int>(segments.size());
  CrossValidation result;
  StretchGrid(fit.problem().data()).AddTo(&result.stretches);
  const Folds folds = FoldsOf(fit);
  for (int first = 0, end = 0; first < count; first = end) {
    const int rank = fit.theta_basis().rank();
    Eigen::MatrixXd H = Eigen::MatrixXd::Zero(rank, rank);
    Eigen::VectorXd g = Eigen::VectorXd::Zero(rank);
    for (; end < count && folds.fold[end] == folds.fold[first]; ++end) {
      const Eigen::MatrixXd& B = fit.theta_basis().of(end);
      H.noalias() += B.transpose() * B;
      g.noalias() += B.transpose() * segments[end]->r;
    }
    Eigen::VectorXd change = g;
    if (rank > 0) {
      const SymmetricEigen eigen = EigenOfSymmetric(H);
      const auto others = 1.0 - eigen.values.array().min(kLeftOut);
      change = eigen.vectors *
               (eigen.vectors.transpose() * g).cwiseQuotient(others.matrix());
    }
    for (int s = first; s < end; ++s) {
      const Eigen::VectorXd e =
          segments[s]->r + fit.theta_basis().of(s) * change;
      const int rows = segments[s]->rows();
      Stretch& stretch = result.stretches[folds.stretch[s]];
      stretch.squares += e.head(rows).squaredNorm();
      stretch.dof += segments[s]->numbers() - state_dof;
    }
  }
  return result;
}

void AddHeldOut(const DataSet& data, const RunErrors& errors, double state_dof,
                CrossValidation* to) {
  const StretchGrid grid(data);
  std::map<std::string, int> runs;
  for (const auto& run : data.runs()) {
    runs.emplace(run->run.name, static_cast<int>(runs.size()));
  }
  const size_t before = to->stretches.size();
  grid.AddTo(&to->stretches);
  for (const SegmentError& segment : errors.segments) {
    const double middle = 0.5 * (segment.t_start + segment.t_end);
    Stretch& stretch =
        to->stretches[before + grid.At(runs.at(segment.trajectory), middle)];
    stretch.squares += segment.squares;
    stretch.dof += segment.dof - state_dof;
  }
}

}  // namespace sysid
