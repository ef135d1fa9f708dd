#pragma once

#include <memory>
#include <set>
#include <string>
#include <vector>

#include "sysid/estimation/shooting_problem.h"
#include "sysid/inverse_dynamics/equation_columns.h"
#include "sysid/inverse_dynamics/equation_rows.h"
#include "sysid/inverse_dynamics/equation_search.h"
#include "sysid/linearization/screening.h"

namespace sysid {

// The efforts of a run by the equations of a fit: what was measured without
// what is left of it, g * u - (r + J d).
class ModelledEfforts {
 public:
  ModelledEfforts(const EquationRows& rows, const EquationModels::Fit& fit,
                  const std::vector<int>& undriven);
  // At the times of a motion, between those of the rows.
  RowMatrixXd At(const SampledMotion& sampled) const;

 private:
  std::vector<double> t_;
  RowMatrixXd u_;  // times x nv
};

// A model and candidates, as columns of the equations of all runs.
class ColumnsOfRuns {
 public:
  // All must outlive it. `all_laws` as in MakeEquationColumns.
  ColumnsOfRuns(const ShootingProblem& problem, const Model& start,
                const std::vector<FreeParameter>& free,
                const std::vector<std::shared_ptr<const Effect>>& candidates,
                const std::set<std::string>& known,
                const std::vector<int>& undriven, bool all_laws);
  ColumnsOfRuns(const ColumnsOfRuns&) = delete;
  ColumnsOfRuns& operator=(const ColumnsOfRuns&) = delete;

  // Of the links that move, those of a possible body and of which nothing is
  // free already.
  void AskBodies();

  const Model& model() const { return columns_.passes[0].model; }
  const std::vector<int>& links() const { return links_; }  // of AskBodies()
  int candidates() const {
    return static_cast<int>(columns_.candidates.size());
  }

  // `efforts`, by run (null: the recorded ones): what laws that read efforts
  // read.
  std::vector<EquationRows> Rows(
      const EquationFilter& filter,
      const std::vector<ModelledEfforts>* efforts = nullptr) const;
  // Ends where it has more special laws than `most`.
  std::unique_ptr<EquationSearch> Search(const std::vector<EquationRows>& rows,
                                         const std::vector<int>& silent,
                                         bool bodies_are_free,
                                         int most = EquationSearch::kAll) const;

  // Where all that was chosen is of the first pass, with the bodies as given.
  MechanismParameters<double> ValuesOf(const EquationSearch& search) const;
  // Whether a chosen law reads efforts.
  bool ReadEfforts(const EquationSearch& search) const;
  std::vector<ScreenedEffect> EffectsOf(EquationSearch* search) const;

 private:
  EquationRows RowsOf(const Run& run, const EquationFilter& filter,
                      const ModelledEfforts* efforts) const;
  EquationRows RowsOfPass(size_t i, const SampledMotion& sampled) const;
  RowMatrixXd BodyColumns(const SampledMotion& sampled, int threads) const;

  const ShootingProblem& problem_;
  const Model& start_;
  const std::vector<FreeParameter>& free_;
  const std::vector<int>& undriven_;
  const EquationColumns columns_;
  const std::vector<int> gains_;
  std::vector<ParameterMap> maps_;  // by pass
  std::vector<int> links_;
  EquationModels::Bodies bodies_;
};

}  // namespace sysid
