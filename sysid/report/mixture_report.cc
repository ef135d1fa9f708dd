#include "sysid/report/mixture_report.h"

#include "models/urdf/write_urdf.h"
#include "sysid/io/csv.h"
#include "sysid/report/text.h"

namespace sysid {

std::string MixtureText(const MixtureFit& mixture) {
  const ParameterMixture& kernels = mixture.mixture;
  std::string text = "\n  kernel   weight";
  for (const ParameterEstimate& p : mixture.fit.parameters) {
    text += Format("  %24s", p.name.c_str());
  }
  text += "\n";
  const auto row = [&](const std::string& name, const std::string& weight,
                       const Eigen::VectorXd& mean,
                       const Eigen::VectorXd& std) {
    text += Format("  %-7s %7s", name.c_str(), weight.c_str());
    for (int i = 0; i < mean.size(); ++i) {
      text += Format("  %24s", Format("%.5g +- %.2g", mean[i], std[i]).c_str());
    }
    text += "\n";
  };
  for (int k = 0; k < kernels.weights.size(); ++k) {
    row(std::to_string(k + 1), Format("%.3f", kernels.weights[k]),
        kernels.means.row(k), kernels.stds.row(k));
  }
  row("mixture", "", kernels.Mean(), kernels.Std());
  text +=
      "  (+- is one standard deviation of a kernel: a result of training, not "
      "the uncertainty due to the noise)\n";
  for (const std::string& remark : mixture.remarks) {
    text += "  " + remark + "\n";
  }
  return text;
}

SampledModels SampleModels(const Session& session,
                           const ShootingProblem& problem,
                           const MixtureFit& mixture, int count,
                           std::uint64_t seed) {
  const Eigen::MatrixXd values =
      SampleParameters(problem, mixture.kernels, count, seed);
  std::vector<Parameter> parameters;
  SampledModels out;
  out.csv = "sample";
  for (const FreeParameter& free : problem.free()) {
    parameters.push_back(free.parameter);
    out.csv += "," + CsvCell(free.parameter.name);
  }
  out.csv += "\n";
  for (int i = 0; i < count; ++i) {
    const std::string number = std::to_string(i + 1);
    std::vector<std::string> comments{
        "draw " + number + " of " + std::to_string(count) +
        " from the mixture that sysid_fit --solver gmm identified for " +
        session.model_name};
    if (!mixture.fit.converged) {
      comments.push_back("not converged: " + mixture.fit.termination);
    }
    out.csv += number;
    std::vector<double> row;
    for (size_t p = 0; p < parameters.size(); ++p) {
      row.push_back(values(i, p));
      out.csv += "," + ShortestText(row.back());
      comments.push_back(parameters[p].name + " = " + ShortestText(row.back()) +
                         " " + parameters[p].unit);
    }
    out.csv += "\n";
    Model model = session.model;
    SetParameters(parameters, row, &model);
    out.urdfs.push_back(WriteUrdf(model, comments));
  }
  return out;
}

}  // namespace sysid
