#pragma once

#include <string>
#include <vector>

#include "sysid/inverse_dynamics/effort_comparison.h"
#include "sysid/report/page_data.h"

namespace sysid {

// Parts of the page's document.

// A Series of page_data.ts: little-endian float32 in base64, missing numbers
// NaN. Seven digits, which no screen shows, in 5.3 characters a number.
Json Series(const std::vector<double>& values);
// Of times, which may be seconds since 1970: less an `offset` where single
// precision would not tell them apart.
Json TimeSeries(std::vector<double> times);
// Of each column of a matrix.
Json SeriesOfColumns(const RowMatrixXd& values);
// The same in 65535 steps between the least and the largest value, two bytes a
// number: what is only drawn.
Json DrawnSeries(const std::vector<double>& values);
// Of each column of a matrix, to be drawn.
Json DrawnColumns(const RowMatrixXd& values);

// Of a diagnosis:

// What a step did: "+ a@j", "- b@k", or both.
std::string ChangeTitle(const DiagnosisStep& step);

// A CrossValidationData; null where the model was not cross-validated.
Json CrossValidationJson(const CrossValidation& cv);
// ModelData.rivals.
Json RivalsJson(const Diagnosis& diagnosis);
// ModelData.proposals.
Json ProposalsJson(const PageSource& source, const Diagnosis& diagnosis);
// As diagnosis.json has them: all by strata, and the effects that stand in.
Json StabilityJson(const std::vector<ParameterByStrata>& all);
Json StandInsJson(const std::vector<ParameterByStrata>& stand_ins);
// The final model without each of its effects; null where it has none.
Json LeftOutJson(const ModelComparison& comparison);

// ModelData.candidates.
Json CandidatesJson(const PageSource& source, const Diagnosis& diagnosis);
// ModelData.force.
Json ForcesJson(const Where& where);

// Of the errors of the measured positions:

// ModelData.residuals: whether they are white noise. Null where they cannot be
// linearised, or where the model was not fitted to them.
Json ResidualsJson(const PageSource& source, const PageFit& fit);

// Of efforts by the inverse dynamics:

// Empty where none were measured, or a joint's position was not.
struct ModelEfforts {
  EffortComparison fitted, held_out;
};
ModelEfforts CompareModelEfforts(const PageFit& fit);
// ModelData.efforts and ModelData.holdoutEfforts.
Json EffortErrorsJson(const EffortComparison& comparison);
// PredictionData.efforts, of one of the `runs` runs that are compared.
Json EffortCurvesJson(const EffortComparison& comparison, int run, int runs);

// Of runs:

// PageData.runs.
Json RunsJson(const PageSource& source);
// ModelData.predictions: of each of those runs what a model predicts for it,
// sample by sample, whatever part of it the model was fitted to.
Json PredictionsJson(const PageSource& source, const PageFit& fit,
                     const ModelEfforts& efforts);

}  // namespace sysid
