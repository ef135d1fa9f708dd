#include "sysid/estimation/linearization.h"

#include <cmath>
#include <functional>
#include <utility>

#include "residuals/costs.h"
#include "sysid/estimation/elimination.h"
#include "sysid/estimation/parallel.h"
#include "sysid/estimation/shooting_segment.h"
#include "sysid/estimation/state_weights.h"

namespace sysid {
namespace {

using Map = Eigen::Map<RowMatrixXd>;

// The triangular factor of a segment's measured rows; those of the defect, the
// last, stay as they are.
void Triangularise(SegmentLinearization* segment) {
  const int tangent = static_cast<int>(segment->J_x.cols());
  const int n_theta = static_cast<int>(segment->J_theta.cols());
  const int defects = static_cast<int>(segment->J_next.cols());
  const int measured = static_cast<int>(segment->r.size()) - defects;
  RowMatrixXd rows(measured, tangent + n_theta + 1);
  rows << segment->J_x.topRows(measured), segment->J_theta.topRows(measured),
      segment->r.head(measured);
  const RowMatrixXd R = TriangularFactor(rows);
  SegmentLinearization small;
  const int all = static_cast<int>(R.rows()) + defects;
  small.J_x.resize(all, tangent);
  small.J_x << R.leftCols(tangent), segment->J_x.bottomRows(defects);
  small.J_theta.resize(all, n_theta);
  small.J_theta << R.middleCols(tangent, n_theta),
      segment->J_theta.bottomRows(defects);
  small.r.resize(all);
  small.r << R.rightCols(1), segment->r.tail(defects);
  small.J_next.setZero(all, defects);
  small.J_next.bottomRows(defects) = segment->J_next.bottomRows(defects);
  *segment = std::move(small);
}

// The segments of a solution, one after another.
class Linearizer {
 public:
  Linearizer(const ShootingProblem& problem, const Solution& solution,
             const LinearizationOptions& options)
      : problem_(problem),
        solution_(solution),
        options_(options),
        joined_(std::isfinite(options.defect)),
        belief_(StateBelief(problem, options.twist_hold)) {
    if (!joined_) return;
    defect_sigma_ = DefectSigma(problem);
    for (double& sigma : defect_sigma_) sigma *= options.defect;
  }

  // Calls `linearize` for each segment and adds the beliefs.
  bool All(const std::function<bool(const SegmentPlace& at,
                                    SegmentLinearization* out)>& linearize,
           std::vector<RunLinearization>* runs) const;
  bool Linearize(const SegmentPlace& at, SegmentLinearization* out);
  // The rows alone, integrated in another way.
  bool Roll(const SegmentPlace& at, const RolloutOptions& rollout,
            Eigen::VectorXd* r);

 private:
  const double* State(int run, int segment) const {
    const RowMatrixXd& states = solution_.runs[run].states;
    return states.data() + segment * states.cols();
  }
  bool HasDefect(const SegmentPlace& at) const {
    return joined_ && at.segment + 1 < solution_.runs[at.run].segments();
  }
  // The belief about a run's first state is the run's.
  bool HasOwnBelief(const SegmentPlace& at) const {
    return !joined_ && at.segment > 0;
  }
  ShootingSegment SegmentAt(const SegmentPlace& at,
                            const RolloutOptions& rollout) {
    const std::vector<int>& samples = solution_.runs[at.run].samples;
    return ShootingSegment(problem_, rollout, at.run, samples[at.segment],
                           samples[at.segment + 1], &pool_,
                           options_.tangent_step);
  }
  // x [-] the state that is believed, whitened; J by x's tangent.
  void Belief(const SegmentPlace& at, Eigen::VectorXd* r, RowMatrixXd* J) const;

  const ShootingProblem& problem_;
  const Solution& solution_;
  const LinearizationOptions options_;
  const bool joined_;
  const std::vector<double> belief_;
  std::vector<double> defect_sigma_;
  ScratchPool pool_;
};

void Linearizer::Belief(const SegmentPlace& at, Eigen::VectorXd* r,
                        RowMatrixXd* J) const {
  const int tangent = static_cast<int>(belief_.size());
  r->setZero(tangent);
  J->setIdentity(tangent, tangent);
  if (options_.believed != nullptr) {
    RowMatrixXd J_believed;
    const RowMatrixXd& states = options_.believed->runs[at.run].states;
    StateDefect(problem_.model(), State(at.run, at.segment),
                states.data() + at.segment * states.cols(), r->data(), J,
                &J_believed);
  }
  const bool at_start = solution_.runs[at.run].samples[at.segment] == 0;
  const std::vector<double> sigma =
      at_start ? BeliefAtStart(problem_, at.run, options_.twist_hold,
                               State(at.run, at.segment))
                     .sigma
               : belief_;
  Whitening(sigma).Apply(r->data(), {Map(J->data(), tangent, tangent)});
}

bool Linearizer::Roll(const SegmentPlace& at, const RolloutOptions& rollout,
                      Eigen::VectorXd* r) {
  Eigen::VectorXd x_end;
  if (!SegmentAt(at, rollout)
           .RollRows(State(at.run, at.segment), solution_.theta.data(), r,
                     &x_end)) {
    return false;
  }
  Eigen::VectorXd more;
  if (HasOwnBelief(at)) {
    RowMatrixXd J;
    Belief(at, &more, &J);
  } else if (HasDefect(at)) {
    more.resize(problem_.model().tangent_size());
    StateDefect(problem_.model(), x_end.data(), State(at.run, at.segment + 1),
                more.data(), nullptr, nullptr);
    Whitening(defect_sigma_).Apply(more.data(), {});
  }
  r->conservativeResize(r->size() + more.size());
  r->tail(more.size()) = more;
  return true;
}

bool Linearizer::Linearize(const SegmentPlace& at, SegmentLinearization* out) {
  const Model& model = problem_.model();
  const int tangent = model.tangent_size(), n_theta = problem_.map().size();
  Eigen::VectorXd x_end;
  RowMatrixXd J, J_end;
  if (!SegmentAt(at, solution_.rollout)
           .LinearizeRows(State(at.run, at.segment), solution_.theta.data(),
                          ShootingSegment::Columns::kBoth, &out->r, &x_end, &J,
                          &J_end)) {
    return false;
  }
  const int measured = static_cast<int>(J.rows());
  Eigen::VectorXd more;
  RowMatrixXd J_more(0, J.cols());
  if (HasDefect(at)) {
    RowMatrixXd D_end, D_next;
    more.resize(tangent);
    StateDefect(model, x_end.data(), State(at.run, at.segment + 1), more.data(),
                &D_end, &D_next);
    J_more = D_end * J_end;
    Whitening(defect_sigma_)
        .Apply(more.data(), {Map(J_more.data(), tangent, J_more.cols()),
                             Map(D_next.data(), tangent, tangent)});
    out->J_next.setZero(measured + tangent, tangent);
    out->J_next.bottomRows(tangent) = D_next;
  } else if (HasOwnBelief(at)) {
    RowMatrixXd J_belief;
    Belief(at, &more, &J_belief);
    J_more.setZero(tangent, J.cols());
    J_more.leftCols(tangent) = J_belief;
  }
  J.conservativeResize(measured + J_more.rows(), Eigen::NoChange);
  J.bottomRows(J_more.rows()) = J_more;
  out->r.conservativeResize(measured + more.size());
  out->r.tail(more.size()) = more;
  out->J_x = J.leftCols(tangent);
  out->J_theta = J.rightCols(n_theta);
  return true;
}

bool Linearizer::All(
    const std::function<bool(const SegmentPlace&, SegmentLinearization*)>&
        linearize,
    std::vector<RunLinearization>* runs) const {
  runs->assign(solution_.runs.size(), {});
  for (size_t r = 0; r < runs->size(); ++r) {
    (*runs)[r].segments.resize(solution_.runs[r].segments());
    Belief({static_cast<int>(r), 0}, &(*runs)[r].r_prior, &(*runs)[r].J_prior);
  }
  const std::vector<SegmentPlace> all = AllSegments(solution_);
  const bool ok = ParallelFor(
      static_cast<int>(all.size()), problem_.options().threads, [&](int i) {
        const auto [run, k] = all[i];
        SegmentLinearization* out = &(*runs)[run].segments[k];
        if (!linearize(all[i], out)) return false;
        if (options_.triangular) Triangularise(out);
        return true;
      });
  return AllTrue(problem_.processes(), ok);
}

}  // namespace

bool Linearize(const ShootingProblem& problem, const Solution& solution,
               const LinearizationOptions& options,
               std::vector<RunLinearization>* runs) {
  Linearizer linearizer(problem, solution, options);
  return linearizer.All(
      [&](const SegmentPlace& at, SegmentLinearization* out) {
        return linearizer.Linearize(at, out);
      },
      runs);
}

bool LinearizeChange(const ShootingProblem& problem, const Solution& solution,
                     const LinearizationOptions& options,
                     const RolloutOptions& to, SegmentResiduals* residuals,
                     std::vector<RunLinearization>* runs) {
  Linearizer linearizer(problem, solution, options);
  const bool own = residuals->empty();
  residuals->resize(solution.runs.size());
  for (size_t r = 0; r < residuals->size(); ++r) {
    (*residuals)[r].resize(solution.runs[r].segments());
  }
  return linearizer.All(
      [&](const SegmentPlace& at, SegmentLinearization* out) {
        Eigen::VectorXd* before = &(*residuals)[at.run][at.segment];
        Eigen::VectorXd after;
        if (!linearizer.Linearize(at, out) ||
            !linearizer.Roll(at, to, &after)) {
          return false;
        }
        out->r = after - (own ? out->r : *before);
        *before = std::move(after);
        return true;
      },
      runs);
}

void LinearizePriors(const ShootingProblem& problem,
                     const Eigen::VectorXd& theta, RowMatrixXd* J,
                     Eigen::VectorXd* r) {
  int rows = 0;
  for (const FreeParameter& free : problem.free()) rows += free.prior ? 1 : 0;
  J->setZero(rows, problem.map().size());
  r->resize(rows);
  int row = 0;
  for (size_t i = 0; i < problem.free().size(); ++i) {
    const auto& prior = problem.free()[i].prior;
    if (!prior) continue;
    (*J)(row, i) = 1.0 / prior->std;
    (*r)[row++] = (theta[i] - prior->mean) / prior->std;
  }
}

}  // namespace sysid
