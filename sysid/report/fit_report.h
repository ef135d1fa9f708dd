#pragma once

#include <optional>
#include <string>
#include <vector>

#include "sysid/api/identify.h"
#include "sysid/estimation/evaluation.h"
#include "sysid/estimation/fit.h"
#include "sysid/session/added_effects.h"
#include "sysid/session/session.h"
#include "sysid/stochastic/stochastic_fit.h"

namespace sysid {

// A fit as people and programs read it. Everything here turns numbers into
// text; nothing computes.

// The parameters of a fit, with those that were searched, not fitted: they have
// no standard error.
std::vector<ParameterEstimate> ReportedParameters(const Session& session,
                                                  const Fit& fit);

// Whether a fit converged, and its error is no more than noise, as far as the
// data tells it.
bool ReachesNoise(const ShootingProblem& problem, const Fit& fit);

// The error beside the noise and what it says of the model, in a sentence.
std::string FitSentence(const ShootingProblem& problem, const Fit& fit,
                        const Holdout* holdout);

// fit.json of docs/interface.md section 6. Numbers finite or null. `added` (may
// be null) says what effects that the user added did; `mixture` (null but for
// --solver gmm) becomes the posterior, and its kernels at every epoch the
// history.
std::string FitJson(const Session& session, const ShootingProblem& problem,
                    const Fit& fit, const Holdout* holdout,
                    const AddedEffects* added = nullptr,
                    const MixtureFit* mixture = nullptr);

// The table on the terminal: parameters, the error beside the noise in one
// sentence, where it is worst, what the data cannot tell apart. `colour` uses
// the terminal's.
std::string FitText(const Session& session, const ShootingProblem& problem,
                    const Fit& fit, const Holdout* holdout,
                    const AddedEffects* added, bool colour);

// Both of a result; the text with what there is to say of a mixture.
std::string FitJson(const IdentifyResult& result);
std::string FitText(const IdentifyResult& result, bool colour);

// J.force_table.csv of each table of a model (force_table@J): J.q, J.qd and
// J.force, SI, on a grid over its range.
struct ForceTableFile {
  std::string name, text;
};
std::vector<ForceTableFile> ForceTableFiles(const Model& model);

// A run as a point predicts it: the states at its samples (samples x
// state_size), and each channel as PredictChannels gives it.
struct Prediction {
  RowMatrixXd states;
  std::vector<RowMatrixXd> channels;
};
// Nothing where the dynamics fail.
std::optional<Prediction> Predict(const ShootingProblem& problem,
                                  const Solution& point, int run);

// The measurement as near to the prediction as its meaning allows: angles of
// the same turn, quaternions of the same sign.
Eigen::RowVectorXd Nearest(const Channel& channel, const Mechanism& mechanism,
                           int sample, const Eigen::RowVectorXd& predicted);

// prediction.csv: for each channel measured, predicted, and where the joint has
// one degree of freedom the residual, over t; several runs follow each other
// on t with a gap of 1 s, told apart by the column `run` (0, 1, ...) and their
// own time `t_run`. Held-out runs come last.
std::string PredictionCsv(const ShootingProblem& problem, const Fit& fit,
                          const Holdout* holdout);

// identified.urdf of docs/interface.md section 1: the fitted model, which loads
// again and reproduces the fit; what URDF cannot say is in comments.
std::string IdentifiedUrdf(const Session& session, const Fit& fit);

// identified.sysid.yaml, the specification beside it: the same parameters free,
// starting from the estimates, with the effects and values that URDF cannot
// say. So `sysid_fit --model DIR/identified.urdf` goes on from the fit.
std::string IdentifiedSpecification(const Session& session, const Fit& fit);

}  // namespace sysid
