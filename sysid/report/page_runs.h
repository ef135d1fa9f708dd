#pragma once

#include "sysid/report/page_data.h"

namespace sysid {

// The parts of the page's document that are made of runs.

// PageData.runs.
Json RunsJson(const PageSource& source);
// ModelData.predictions: of each of those runs what a model predicts for it,
// sample by sample, whatever part of it the model was fitted to.
Json PredictionsJson(const PageSource& source, const PageFit& fit);

}  // namespace sysid
