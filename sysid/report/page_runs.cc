#include <algorithm>
#include <map>

#include "models/math/constants.h"
#include "sysid/report/fit_report.h"
#include "sysid/report/page_channel.h"
#include "sysid/report/page_parts.h"

namespace sysid {
namespace {

// The runs of the page, fitted ones first.
std::vector<const Run*> ShownRuns(const PageSource& source) {
  std::vector<const Run*> runs;
  for (const auto& data : source.train->runs()) runs.push_back(&data->run);
  if (source.holdout != nullptr) {
    for (const auto& data : source.holdout->runs()) runs.push_back(&data->run);
  }
  return runs;
}

// Held-out channels have the noise of the fitted ones of the same name.
std::map<std::string, double> NoiseOf(const DataSet& train) {
  std::map<std::string, double> noise;
  for (const auto& data : train.runs()) {
    for (size_t c = 0; c < data->run.channels.size(); ++c) {
      noise.emplace(data->run.channels[c].name, data->sigma[c]);
    }
  }
  return noise;
}

double SigmaOf(const std::map<std::string, double>& noise,
               const Channel& channel) {
  const auto at = noise.find(channel.name);
  return at == noise.end() ? kNaN : at->second;
}

Json EffortsJson(const Mechanism& mechanism, const Run& run) {
  Json list = Json::array();
  for (const Joint& joint : mechanism.joints) {
    const int nv = VelocitySize(joint);
    if (nv == 0) continue;
    if (!HasEffort(run, joint.v_index, nv)) continue;
    const RowMatrixXd effort = run.effort.middleCols(joint.v_index, nv);
    list.push_back(
        {{"joint", joint.name},
         {"components", nv == 1 ? Json{"tau"} : Json{"taux", "tauy", "tauz"}},
         {"unit", joint.type == JointType::kPrismatic ? "N" : "N m"},
         {"values", SeriesOfColumns(effort)}});
  }
  return list;
}

// A shown run among the runs that a model was fitted to or judged by.
struct Place {
  const ShootingProblem* problem = nullptr;  // null: it is none of them
  const Solution* point = nullptr;
  int run = 0;
  std::vector<int> samples;  // there, of each shown one; -1: not there
  int found = 0;
};

void Look(const Run& shown, const ShootingProblem& problem,
          const Solution& point, Place* best) {
  for (size_t r = 0; r < problem.runs().size() && r < point.runs.size(); ++r) {
    const Run& run = problem.runs()[r]->run;
    if (run.name != shown.name) continue;
    Place place{&problem, &point, static_cast<int>(r), {}, 0};
    for (const double t : shown.t) {
      const auto at = std::lower_bound(run.t.begin(), run.t.end(), t);
      const bool there = at != run.t.end() && *at == t;
      place.samples.push_back(there ? static_cast<int>(at - run.t.begin())
                                    : -1);
      place.found += there ? 1 : 0;
    }
    if (place.found > best->found) *best = std::move(place);
  }
}

Place Find(const Run& shown, const PageFit& fit) {
  Place place;
  Look(shown, *fit.problem, fit.fit->point, &place);
  if (fit.holdout != nullptr) {
    Look(shown, *fit.holdout->problem, fit.holdout->point, &place);
  }
  return place;
}

// Where the model's segments begin within the run, and its end.
Json CutsJson(const Run& shown, const Place& place) {
  Json cuts = Json::array({shown.t.front()});
  if (place.problem != nullptr) {
    const std::vector<double>& t = place.problem->runs()[place.run]->run.t;
    for (const int sample : place.point->runs[place.run].samples) {
      if (t[sample] > shown.t.front() && t[sample] < shown.t.back()) {
        cuts.push_back(t[sample]);
      }
    }
  }
  cuts.push_back(shown.t.back());
  return cuts;
}

// Rows of a prediction at the shown samples.
RowMatrixXd At(const std::vector<int>& samples, const RowMatrixXd& all) {
  RowMatrixXd rows(samples.size(), all.cols());
  for (size_t k = 0; k < samples.size(); ++k) {
    if (samples[k] < 0) {
      rows.row(k).setConstant(kNaN);
    } else {
      rows.row(k) = all.row(samples[k]);
    }
  }
  return rows;
}

// As much of q as was measured, nearest to the predicted.
RowMatrixXd MeasuredPositions(const Mechanism& mechanism, const Run& run,
                              const RowMatrixXd& q) {
  RowMatrixXd measured = RowMatrixXd::Constant(run.size(), mechanism.nq, kNaN);
  for (const Channel& channel : run.channels) {
    if (channel.kind != ChannelKind::kPosition &&
        channel.kind != ChannelKind::kOrientation) {
      continue;
    }
    const int first = mechanism.joints[channel.target].q_index;
    const int size = static_cast<int>(channel.values.cols());
    for (int k = 0; k < run.size(); ++k) {
      const Eigen::RowVectorXd predicted = q.row(k).segment(first, size);
      measured.row(k).segment(first, size) =
          predicted.allFinite() ? Nearest(channel, mechanism, k, predicted)
                                : Eigen::RowVectorXd(channel.values.row(k));
    }
  }
  return measured;
}

// Of the run at a place, as its own problem compares them.
Json EffortsAt(const Place& place, const PageFit& fit,
               const ModelEfforts& efforts) {
  if (place.problem == nullptr) return nullptr;
  return EffortCurvesJson(
      place.problem == fit.problem ? efforts.fitted : efforts.held_out,
      place.run, static_cast<int>(place.problem->runs().size()));
}

Json PredictionJson(const std::map<std::string, double>& noise,
                    const Run& shown, const PageFit& fit,
                    const ModelEfforts& efforts,
                    OrientationResidual orientation) {
  const Mechanism& mechanism = fit.problem->model().mechanism();
  const StateLayout& at = fit.problem->model().layout();
  const Place place = Find(shown, fit);
  std::optional<Prediction> prediction;
  if (place.problem != nullptr) {
    prediction = Predict(*place.problem, *place.point, place.run);
  }
  Json channels = Json::array();
  for (const Channel& channel : shown.channels) {
    RowMatrixXd values =
        RowMatrixXd::Constant(shown.size(), channel.values.cols(), kNaN);
    if (prediction) {
      const std::vector<Channel>& there =
          place.problem->runs()[place.run]->run.channels;
      for (size_t c = 0; c < there.size(); ++c) {
        if (there[c].name != channel.name) continue;
        values = At(place.samples, prediction->channels[c]);
      }
    }
    const ShownChannel as(mechanism, channel, orientation);
    channels.push_back(
        {{"predicted", SeriesOfColumns(as.Predicted(values))},
         {"residual",
          SeriesOfColumns(as.Difference(values) / SigmaOf(noise, channel))}});
  }
  const RowMatrixXd states =
      prediction ? At(place.samples, prediction->states)
                 : RowMatrixXd::Constant(shown.size(), at.size(), kNaN);
  const RowMatrixXd q = states.middleCols(at.q(), at.nq());
  return {{"cuts", CutsJson(shown, place)},
          {"channels", channels},
          {"efforts", EffortsAt(place, fit, efforts)},
          {"q", DrawnColumns(q)},
          {"qd", DrawnColumns(states.middleCols(at.qd(), at.nv()))},
          {"measuredQ", DrawnColumns(MeasuredPositions(mechanism, shown, q))}};
}

}  // namespace

Json RunsJson(const PageSource& source) {
  const Mechanism& mechanism = source.session->model.mechanism();
  const std::map<std::string, double> noise = NoiseOf(*source.train);
  const size_t fitted = source.train->runs().size();
  Json list = Json::array();
  for (const Run* run : ShownRuns(source)) {
    const auto shown = [&](const Channel& channel) -> Json {
      const ShownChannel as(mechanism, channel,
                            source.session->options.orientation);
      const bool frame = channel.kind == ChannelKind::kFramePosition;
      return {{"name", channel.name},
              {"joint", frame ? Json(nullptr)
                              : Json(mechanism.joints[channel.target].name)},
              {"kind", as.kind()},
              {"unit", as.unit()},
              {"noise", Finite(SigmaOf(noise, channel))},
              {"components", as.components()},
              {"measured", SeriesOfColumns(as.measured())}};
    };
    list.push_back({{"name", run->name},
                    {"heldOut", list.size() >= fitted},
                    {"t", TimeSeries(run->t)},
                    {"channels", List(run->channels, shown)},
                    {"efforts", EffortsJson(mechanism, *run)}});
  }
  return list;
}

Json PredictionsJson(const PageSource& source, const PageFit& fit,
                     const ModelEfforts& efforts) {
  const std::map<std::string, double> noise = NoiseOf(*source.train);
  return List(ShownRuns(source), [&](const Run* run) {
    return PredictionJson(noise, *run, fit, efforts,
                          source.session->options.orientation);
  });
}

}  // namespace sysid
