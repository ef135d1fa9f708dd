#include "sysid/simulation/driven_motion.h"

#include <algorithm>
#include <stdexcept>

#include "models/internal_state.h"
#include "models/parameters.h"
#include "residuals/acting_inputs.h"
#include "residuals/segment.h"

namespace sysid {
namespace {

// One motion with steps of a given length.
class Roll {
 public:
  Roll(const Model& model, const Eigen::VectorXd& x0, Integrator integrator,
       const DriveLaw& drive, Run* run)
      : model_(model),
        x0_(x0),
        integrator_(integrator),
        drive_(drive),
        run_(*run),
        nothing_(model, {}),
        measurements_{run, {}} {}

  bool operator()(double step, RowMatrixXd* states) {
    return (drive_ ? Driven(step, states) : Open(step, states)) &&
           states->allFinite();
  }

 private:
  // From sample `first` to `last`; the states between them too.
  bool Advance(int first, int last, double step, const Eigen::VectorXd& x,
               Eigen::VectorXd* x_end, std::vector<double>* states) {
    const SegmentRollout rollout(&model_, &nothing_, &measurements_, first,
                                 last, {integrator_, step});
    return rollout(x.data(), static_cast<const double*>(nullptr),
                   static_cast<double*>(nullptr), x_end->data(), states);
  }

  bool Open(double step, RowMatrixXd* states) {
    Eigen::VectorXd x_end(x0_.size());
    std::vector<double> visited;
    if (!Advance(0, run_.size() - 1, step, x0_, &x_end, &visited)) return false;
    *states =
        Eigen::Map<const RowMatrixXd>(visited.data(), run_.size(), x0_.size());
    return true;
  }

  // Efforts that act later (effort_delay) are those of rows before, which are
  // there.
  bool Driven(double step, RowMatrixXd* states) {
    states->resize(run_.size(), x0_.size());
    Eigen::VectorXd x = x0_, x_end(x0_.size()), effort(model_.nv());
    for (int k = 0;; ++k) {
      states->row(k) = x;
      effort.setZero();
      drive_(k, run_.t[k], x, effort);
      if (!effort.allFinite()) return false;
      run_.effort.row(k) = effort;
      if (k == run_.size() - 1) return true;
      if (!Advance(k, k + 1, step, x, &x_end, nullptr) || !x_end.allFinite()) {
        return false;
      }
      x = x_end;
    }
  }

  const Model& model_;
  const Eigen::VectorXd& x0_;
  Integrator integrator_;
  const DriveLaw& drive_;
  Run& run_;
  ParameterMap nothing_;
  Measurements measurements_;
};

// x0, internal states of effects as they start.
Eigen::VectorXd WithStates(const Model& model, Eigen::VectorXd x0,
                           const Run& run) {
  if (model.layout().nz() == 0) return x0;
  Workspace<double> ws(model);
  std::vector<double> held(model.held_size());
  ActingInputs<double>(run, ws, 0, run.t[0], run.t[1] - run.t[0], held.data());
  StartStates(&ws, held.data(), x0.data());
  return x0;
}

}  // namespace

RowMatrixXd DrivenMotion(const Model& model, const Eigen::VectorXd& x0,
                         const MotionOptions& options, const DriveLaw& drive,
                         Run* run) {
  if (x0.size() != model.layout().size()) {
    throw std::invalid_argument("a state of another model");
  }
  const Eigen::VectorXd started = WithStates(model, x0, *run);
  Roll roll(model, started, options.integrator, drive, run);
  RowMatrixXd states, finer;
  if (options.step > 0) {
    if (roll(options.step, &states)) return states;
    return {};
  }
  const double period = run->t[1] - run->t[0];
  bool have = roll(period, &states);
  // In chaos the two never agree; 256 steps a sample are then the truth.
  for (int parts = 2; parts <= 256; parts *= 2) {
    const bool have_finer = roll(period / parts, &finer);
    if (have && have_finer &&
        (states - finer)
                .middleCols(model.layout().q(), model.nq())
                .cwiseAbs()
                .maxCoeff() < options.tolerance) {
      return finer;
    }
    have = have_finer;
    states = finer;
  }
  if (have) return states;
  return {};
}

}  // namespace sysid
