#include "sysid/report/sampled_models.h"

#include "models/error.h"
#include "models/urdf/write_urdf.h"
#include "sysid/estimation/estimate_draws.h"
#include "sysid/io/csv.h"
#include "sysid/io/memory.h"
#include "sysid/report/text.h"

namespace sysid {
namespace {

// What the draws from an estimate hold.
std::vector<std::string> RemarksOn(const Fit& fit) {
  std::vector<std::string> remarks;
  for (const std::vector<std::string>& group : fit.not_identifiable) {
    remarks.push_back(NotIdentifiable(group) +
                      (group.size() == 1
                           ? ": in all samples as estimated"
                           : ": the combinations that the data do not "
                             "determine are in all samples as estimated"));
  }
  if (fit.holds_scale) {
    remarks.push_back(
        "without efforts only ratios are identifiable: the scale is in all "
        "samples the URDF's");
  }
  std::vector<std::string> held;
  for (size_t i = 0; i < fit.parameters.size(); ++i) {
    if (fit.parameters[i].at_bound && fit.theta_covariance(i, i) == 0.0) {
      held.push_back(fit.parameters[i].name);
    }
  }
  if (!held.empty()) {
    remarks.push_back(Join(held) + (held.size() == 1 ? " is" : " are") +
                      " at a bound, and in all samples as estimated");
  }
  return remarks;
}

// The draws, count x parameters, as models and as a table.
void Write(const Session& session, const ShootingProblem& problem,
           const Fit& fit, const std::string& source,
           const Eigen::MatrixXd& values, SampledModels* out) {
  std::vector<Parameter> parameters;
  out->csv = "sample";
  for (const FreeParameter& free : problem.free()) {
    parameters.push_back(free.parameter);
    out->csv += "," + CsvCell(free.parameter.name);
  }
  out->csv += "\n";
  const std::string count = std::to_string(values.rows());
  for (int i = 0; i < values.rows(); ++i) {
    const std::string number = std::to_string(i + 1);
    std::vector<std::string> comments{
        "draw " + number + " of " + count + " from the " + source +
        " that sysid_fit --solver " + session.solver + " identified for " +
        session.model_name};
    if (!fit.converged) {
      comments.push_back("not converged: " + fit.termination);
    }
    comments.insert(comments.end(), out->remarks.begin(), out->remarks.end());
    out->csv += number;
    std::vector<double> row;
    for (size_t p = 0; p < parameters.size(); ++p) {
      row.push_back(values(i, p));
      out->csv += "," + ShortestText(row.back());
      comments.push_back(parameters[p].name + " = " + ShortestText(row.back()) +
                         " " + parameters[p].unit);
    }
    out->csv += "\n";
    Model model = session.model;
    SetParameters(parameters, row, &model);
    out->urdfs.push_back(WriteUrdf(model, comments));
  }
}

}  // namespace

void CheckSampling(const Session& session, int count) {
  if (session.free.empty()) {
    throw InputError("--sample", "has nothing to draw: nothing is free",
                     "name parameters with --free");
  }
  // They are made before any is written: their URDFs and a line each.
  const double urdf = static_cast<double>(WriteUrdf(session.model).size());
  CheckMemory(count * (urdf + 100.0 * session.free.size()), "--sample",
              "to draw that many URDFs", "draw fewer at a time, by --seed");
}

SampledModels SampleModels(const Session& session,
                           const ShootingProblem& problem, const Solved& solved,
                           int count, std::uint64_t seed) {
  SampledModels out;
  if (solved.mixture) {
    Write(session, problem, solved.fit, "mixture",
          SampleParameters(problem, solved.mixture->kernels, count, seed),
          &out);
    return out;
  }
  const EstimateDraws draws = DrawFromEstimate(problem, solved.fit.point.theta,
                                               solved.fit, count, seed);
  out.failure = draws.failure;
  if (!out.failure.empty()) return out;
  out.remarks = RemarksOn(solved.fit);
  Write(session, problem, solved.fit, "normal distribution of the estimate",
        draws.values, &out);
  return out;
}

}  // namespace sysid
