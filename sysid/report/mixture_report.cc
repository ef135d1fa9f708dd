#include "sysid/report/mixture_report.h"

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

}  // namespace sysid
