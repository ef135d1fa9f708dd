#include "tests/acceptance/checks/planted_fault.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>
#include <random>

#include "models/error.h"
#include "sysid/checks/excerpt.h"
#include "sysid/checks/inertia.h"
#include "sysid/checks/readings/edit_run.h"
#include "sysid/checks/run_checks.h"
#include "sysid/checks/series.h"
#include "sysid/estimation/fit.h"
#include "sysid/io/channel_edits.h"
#include "sysid/session/check_runs.h"
#include "sysid/session/check_session.h"
#include "sysid/simulation/simulate.h"
#include "tests/acceptance/checks/resampled.h"

namespace sysid {
namespace {

using Planted = std::optional<Session>;

class Random {
 public:
  explicit Random(std::uint64_t seed) : engine_(seed) {}
  double Uniform(double a, double b) {
    return std::uniform_real_distribution<double>(a, b)(engine_);
  }
  double Normal() { return std::normal_distribution<double>()(engine_); }
  double Sign() { return Uniform(0, 1) < 0.5 ? -1.0 : 1.0; }
  int Below(int n) { return static_cast<int>(Uniform(0, n) * (1 - 1e-12)); }

 private:
  std::mt19937_64 engine_;
};

bool IsHinge(const Joint& joint) { return IsRotation1(joint.type); }

std::vector<int> JointsThat(const Session& session,
                            const std::function<bool(int)>& fit) {
  std::vector<int> joints;
  for (size_t j = 0; j < session.model.mechanism().joints.size(); ++j) {
    if (fit(static_cast<int>(j))) joints.push_back(static_cast<int>(j));
  }
  return joints;
}

bool HasPosition(const Session& session, int joint) {
  for (const Channel& channel : session.runs.front().channels) {
    if (channel.kind == ChannelKind::kPosition && channel.target == joint) {
      return true;
    }
  }
  return false;
}

bool HasEffort(const Session& session, int joint) {
  const Joint& j = session.model.mechanism().joints[joint];
  return j.type != JointType::kFixed &&
         !session.runs.front().effort.col(j.v_index).isZero(0.0);
}

std::vector<int> Simple(const Session& session) {
  return JointsThat(session, [&](int j) {
    return IsSimple(session.model.mechanism().joints[j]) &&
           HasPosition(session, j);
  });
}

std::vector<int> Driven(const Session& session) {
  return JointsThat(session, [&](int j) {
    return IsSimple(session.model.mechanism().joints[j]) &&
           HasEffort(session, j);
  });
}

std::vector<int> Balls(const Session& session) {
  return JointsThat(session, [&](int j) {
    return session.model.mechanism().joints[j].type == JointType::kSpherical;
  });
}

// Every run of a copy, changed.
Session Changed(const Session& session,
                const std::function<void(Run*)>& change) {
  Session changed = session;
  for (Run& run : changed.runs) change(&run);
  return changed;
}

Channel* Position(Run* run, int joint) {
  return ChannelOf(run, ChannelKind::kPosition, joint);
}

double Range(const Channel& channel) {
  double low = INFINITY, high = -INFINITY;
  for (const double value : channel.values.reshaped()) {
    if (std::isnan(value)) continue;
    low = std::min(low, value);
    high = std::max(high, value);
  }
  return high - low;
}

// A joint drawn from a list; -1 from an empty one.
int Draw(const std::vector<int>& from, Random* random) {
  return from.empty() ? -1 : from[random->Below(static_cast<int>(from.size()))];
}

using Change = std::function<void(int joint, Random*, const Session&, Run*)>;

// Faults of one joint's column.
Fault OfJoint(const std::string& name, std::vector<std::string> as_good,
              const std::function<std::vector<int>(const Session&)>& joints,
              const Change& change) {
  return {name, std::move(as_good),
          [=](const CleanCase& clean, std::uint64_t seed) -> Planted {
            Random random(seed);
            const int joint = Draw(joints(clean.session), &random);
            if (joint < 0) return std::nullopt;
            return Changed(clean.session, [&](Run* run) {
              Random same = random;  // a fault is the same in every run
              change(joint, &same, clean.session, run);
            });
          }};
}

// Of the time column, or of a run as a whole.
Fault OfRun(const std::string& name,
            const std::function<void(Random*, Run*)>& change) {
  return {name, {}, [=](const CleanCase& clean, std::uint64_t seed) -> Planted {
            Random random(seed);
            return Changed(clean.session,
                           [&](Run* run) { change(&random, run); });
          }};
}

Run WithoutRows(const Run& run, int first, int last) {
  Run cut = run;
  const int n = run.size(), lost = last - first;
  cut.t.erase(cut.t.begin() + first, cut.t.begin() + last);
  const auto drop = [&](RowMatrixXd* rows) {
    RowMatrixXd kept(n - lost, rows->cols());
    kept << rows->topRows(first), rows->bottomRows(n - last);
    *rows = kept;
  };
  drop(&cut.effort);
  for (Channel& channel : cut.channels) drop(&channel.values);
  return cut;
}

// Beside each position its slope over five samples.
void AddVelocities(const Mechanism& mechanism, Run* run) {
  std::vector<Channel> channels;
  for (const Channel& channel : run->channels) {
    channels.push_back(channel);
    if (channel.kind != ChannelKind::kPosition) continue;
    Channel velocity = channel;
    velocity.kind = ChannelKind::kVelocity;
    velocity.name = mechanism.joints[channel.target].name + ".qd";
    const int n = run->size();
    for (int k = 0; k < n; ++k) {
      const int a = std::max(0, k - 2), b = std::min(n - 1, k + 2);
      velocity.values(k, 0) = (channel.values(b, 0) - channel.values(a, 0)) /
                              (run->t[b] - run->t[a]);
    }
    channels.push_back(velocity);
  }
  run->channels = channels;
}

Fault OfVelocity(const std::string& name, std::vector<std::string> as_good,
                 const std::function<void(int, const Session&, Run*)>& change,
                 size_t joints) {
  return {name, std::move(as_good),
          [=](const CleanCase& clean, std::uint64_t seed) -> Planted {
            Random random(seed);
            const std::vector<int> simple = Simple(clean.session);
            if (simple.size() < joints) return std::nullopt;
            const int joint = Draw(simple, &random);
            return Changed(clean.session, [&](Run* run) {
              AddVelocities(clean.session.model.mechanism(), run);
              change(joint, clean.session, run);
            });
          }};
}

void Permute(bool inverse, int joint, Run* run) {
  Channel* channel = ChannelOf(run, ChannelKind::kOrientation, joint);
  const RowMatrixXd was = channel->values;  // x, y, z, w
  if (inverse) {
    channel->values.leftCols(3) = -was.leftCols(3);
  } else {
    // What was written x, y, z, w is read as w, x, y, z.
    channel->values.col(3) = was.col(0);
    channel->values.col(0) = was.col(1);
    channel->values.col(1) = was.col(2);
    channel->values.col(2) = was.col(3);
  }
}

// Efforts that have nothing to do with those of the motion: backwards, of
// either sign, and slower, for a sine that is read backwards is a late one;
// begun at a place where they are not alike by chance.
Eigen::VectorXd OfAnotherExperiment(const Eigen::VectorXd& effort,
                                    Random* random) {
  constexpr double kSpeed = 0.63, kUnlike = 0.15;
  const int n = static_cast<int>(effort.size());
  const double sign = random->Sign();
  const Eigen::VectorXd was = effort.array() - effort.mean();
  Eigen::VectorXd other(n), best = effort;
  double least = 1.0;
  for (int tries = 0; tries < 100 && least > kUnlike; ++tries) {
    const int begin = random->Below(n);
    for (int k = 0; k < n; ++k) {
      other[k] =
          sign * effort[(begin + n - 1 - static_cast<int>(kSpeed * k)) % n];
    }
    const Eigen::VectorXd centred = other.array() - other.mean();
    const double alike =
        std::abs(centred.dot(was)) / (centred.norm() * was.norm());
    if (alike < least) {
      least = alike;
      best = other;
    }
  }
  return best;
}

// The model of a clean case: of a real one fitted to it, for what stands in its
// URDF is as rough as its data sheet.
const Model& CleanModel(const CleanCase& clean) {
  if (!clean.real) return clean.session.model;
  static std::map<std::string, Model>& fitted =
      *new std::map<std::string, Model>;
  const Session& session = clean.session;
  const std::string& name = session.runs.front().name;
  const auto known = fitted.find(name);
  if (known != fitted.end()) return known->second;
  ShootingProblem problem(session.model, session.free, session.runs,
                          session.options);
  return fitted.emplace(name, FitLevenbergMarquardt(&problem).model)
      .first->second;
}

Fault OfModel(const std::string& name,
              const std::function<bool(const CleanCase&, int link)>& can,
              const std::function<void(Inertial<double>*)>& change) {
  return {name, {}, [=](const CleanCase& clean, std::uint64_t seed) -> Planted {
            Random random(seed);
            std::vector<int> links;
            const Model& model = CleanModel(clean);
            for (size_t i = 1; i < model.mechanism().links.size(); ++i) {
              if (can(clean, static_cast<int>(i))) {
                links.push_back(static_cast<int>(i));
              }
            }
            const int link = Draw(links, &random);
            if (link < 0) return std::nullopt;
            Session planted = clean.session;
            MechanismParameters<double> values = model.nominal();
            change(&values.links[link]);
            planted.model = model;
            planted.model.SetNominal(values);
            planted.free.clear();
            return planted;
          }};
}

CleanCase Simulated(const std::string& model, bool driven, std::uint64_t seed,
                    const std::string& effect, const std::string& free) {
  const Catalogue catalogue;
  FitRequest request;
  request.model = model;
  request.fits_nothing = true;
  request.free = free;
  request.traj = {"simulated.csv"};
  CleanCase clean{model, OpenModelSession(request, catalogue), false};
  Model truth = clean.session.model;
  Random random(seed);
  if (!effect.empty()) {
    clean.name += " with " + effect;
    const auto made = catalogue.Make(effect, truth.mechanism(), "test");
    truth.AddEffect(made, "test");
    for (const EffectParameter& p : made->parameters()) {
      if (!p.whole) truth.SetEffectParameter(p.name, p.typical_scale);
    }
  }
  SimulationOptions options;
  options.duration = 8.0;
  options.noise = 1e-3;
  options.seed = seed;
  options.excitation = driven ? Excitation::kMultisine : Excitation::kNone;
  options.excitation_level = 0.5;
  const Eigen::VectorXd x0 = RandomState(truth, 1.0, seed);
  clean.session.runs = {Simulate(truth, x0, options)};
  clean.session.runs.front().name = model + ".csv";
  return clean;
}

}  // namespace

std::vector<CleanCase> SimulatedCases(std::uint64_t seed, bool missing) {
  const auto effect = [&](const std::string& name) {
    return missing ? name : std::string();
  };
  std::vector<CleanCase> cases;
  const std::vector<std::string> of_hinge = {
      "coulomb_friction@joint1", "viscous_damping@joint2", "spring@joint1",
      "quadratic_drag@joint2", "armature@joint1"};
  const std::string drawn = of_hinge[seed % of_hinge.size()];
  cases.push_back(Simulated("pendulum2_planar", true, seed, effect(drawn), ""));
  cases.push_back(
      Simulated("pendulum3_planar", false, seed, effect(drawn), ""));
  cases.push_back(
      Simulated("cartpole", true, seed, effect("viscous_damping@slider"), ""));
  cases.push_back(Simulated("pendulum3", false, seed,
                            effect("viscous_damping@joint2"), ""));
  return cases;
}

std::vector<CleanCase> RecordedCases(const std::string& folder) {
  namespace fs = std::filesystem;
  std::vector<CleanCase> cases;
  const Catalogue catalogue;
  const auto add = [&](const std::string& model,
                       const std::vector<std::string>& files, double until) {
    FitRequest request;
    request.model = model;
    for (const std::string& file : files) {
      if (!fs::exists(fs::path(folder) / file)) return;
      request.traj.push_back(fs::path(folder) / file);
    }
    CleanCase clean{model, OpenSession(request, catalogue), true};
    for (Run& run : clean.session.runs) {
      int last = run.size();
      while (last > 2 && run.t[last - 1] > until) --last;
      run = WithoutRows(run, last, run.size());
    }
    cases.push_back(std::move(clean));
  };
  const std::string dfki = "double_pendulum_dfki/traj_";
  // The first two drive both joints, the others one: in pairs that drive both.
  add("double_pendulum_dfki", {dfki + "143339.csv", dfki + "143524.csv"}, 1e9);
  add("double_pendulum_dfki", {dfki + "143704.csv", dfki + "144003.csv"}, 1e9);
  add("double_pendulum_dfki", {dfki + "143747.csv", dfki + "144115.csv"}, 1e9);
  add("emps", {"emps/emps.csv"}, 1e9);
  const std::string simple = "simple_pendulum_dfki/";
  add("simple_pendulum_dfki", {simple + "ddp.csv"}, 6.0);
  add("simple_pendulum_dfki", {simple + "direct_collocation.csv"}, 3.5);
  add("simple_pendulum_dfki", {simple + "energy_shaping.csv"}, 3.8);
  add("video_pendulum", {"video_pendulum/pendulum.csv"}, 1e9);
  return cases;
}

const std::vector<Fault>& Faults() {
  const auto hinges = [](const Session& s) {
    std::vector<int> list = Simple(s);
    std::erase_if(
        list, [&](int j) { return !IsHinge(s.model.mechanism().joints[j]); });
    return list;
  };
  const auto slides = [](const Session& s) {
    std::vector<int> list = Simple(s);
    std::erase_if(
        list, [&](int j) { return IsHinge(s.model.mechanism().joints[j]); });
    return list;
  };
  // A sign shows beside another joint or an effort.
  const auto signed_joints = [](const Session& s) {
    std::vector<int> list = Simple(s);
    if (list.size() < 2 && Driven(s).empty()) list.clear();
    return list;
  };
  const auto second_of_chain = [](const Session& s) {
    const std::vector<int> list = Simple(s);
    return list.size() < 2 || s.model_name == "cartpole"
               ? std::vector<int>()
               : std::vector<int>(list.begin() + 1, list.end());
  };
  const auto timed = [](const Session& s) {
    std::vector<int> list = Simple(s);
    if (list.size() < 2 && Driven(s).empty()) list.clear();
    // A drive that is late by itself has no clean reading.
    if (s.model_name == "simple_pendulum_dfki") list.clear();
    return list;
  };
  // A slide without friction that drifts is one that moves (Galilei).
  const auto felt = [timed](const Session& s) {
    std::vector<int> list = timed(s);
    std::erase_if(list, [&](int j) {
      return !IsHinge(s.model.mechanism().joints[j]) &&
             s.model.effects().size() == 0;
    });
    return list;
  };
  const auto swap = [](int parts) {
    return [parts](const CleanCase& clean, std::uint64_t seed) -> Planted {
      Random random(seed);
      const std::vector<int> list =
          parts == kEffort ? Driven(clean.session) : Simple(clean.session);
      if (list.size() < 2) return std::nullopt;
      const int a = random.Below(static_cast<int>(list.size()) - 1);
      return Changed(clean.session, [&](Run* run) {
        SwapJoints(clean.session.model.mechanism(), list[a], list[a + 1], parts,
                   run);
      });
    };
  };
  static const std::vector<Fault>& faults = *new std::vector<Fault>{
      OfJoint("degrees", {}, hinges,
              [](int j, Random*, const Session& s, Run* run) {
                ScaleJoint(s.model.mechanism(), j, kMotion, 180 / M_PI, run);
              }),
      OfJoint("millimetres", {}, slides,
              [](int j, Random*, const Session& s, Run* run) {
                ScaleJoint(s.model.mechanism(), j, kMotion, 1000.0, run);
              }),
      OfRun("milliseconds",
            [](Random*, Run* run) {
              for (double& t : run->t) t *= 1000.0;
            }),
      OfJoint("axis_flipped", {}, signed_joints,
              [](int j, Random*, const Session& s, Run* run) {
                ScaleJoint(s.model.mechanism(), j, kMotion, -1.0, run);
              }),
      OfJoint("effort_flipped", {"axis_flipped"}, Driven,
              [](int j, Random*, const Session& s, Run* run) {
                ScaleJoint(s.model.mechanism(), j, kEffort, -1.0, run);
              }),
      {"joints_swapped", {}, swap(kMotion)},
      {"efforts_swapped", {"joints_swapped"}, swap(kEffort)},
      OfJoint("absolute_angle", {}, second_of_chain,
              [](int j, Random*, const Session&, Run* run) {
                Position(run, j)->values += Position(run, j - 1)->values;
              }),
      OfJoint("quaternion_order", {}, Balls,
              [](int j, Random*, const Session&, Run* run) {
                Permute(false, j, run);
              }),
      OfJoint("quaternion_inverse", {}, Balls,
              [](int j, Random*, const Session&, Run* run) {
                Permute(true, j, run);
              }),
      OfJoint("channel_late", {}, timed,
              [](int j, Random* random, const Session& s, Run* run) {
                const double delay = random->Sign() * 0.01;
                ChannelEdits edits;
                edits.shifts = {
                    {s.model.mechanism().joints[j].name + ".q", delay, ""}};
                ApplyEdits(edits, s.model.mechanism(), run, nullptr);
              }),
      OfRun("time_jitter",
            [](Random* random, Run* run) {
              const double period = MedianPeriod(run->t);
              // Even samples whose stamps are not.
              for (double& t : run->t) {
                t += period * random->Uniform(-0.45, 0.45);
              }
            }),
      OfRun("gap",
            [](Random* random, Run* run) {
              const int n = run->size();
              const int first = n / 4 + random->Below(n / 2);
              *run = WithoutRows(*run, first, first + 15);
            }),
      {"clock_scale", {},
       [](const CleanCase& clean, std::uint64_t seed) -> Planted {
         Random random(seed);
         // Where a length is free it makes up for any clock.
         if (clean.real || Balls(clean.session).size() +
                                   Simple(clean.session).size() < 2) {
           return std::nullopt;
         }
         Session planted = Changed(clean.session, [&](Run* run) {
           const double scale = random.Sign() > 0 ? 1.3 : 0.75;
           for (double& t : run->t) t *= scale;
         });
         planted.free.clear();
         return planted;
       }},
      OfJoint("quantisation", {}, Simple,
              [](int j, Random* random, const Session&, Run* run) {
                Channel* q = Position(run, j);
                const double step = Range(*q) / random->Uniform(30, 90);
                for (double& v : q->values.reshaped()) {
                  v = step * std::round(v / step);
                }
              }),
      OfJoint("saturation", {}, Simple,
              [](int j, Random* random, const Session&, Run* run) {
                Channel* q = Position(run, j);
                const double top = q->values.maxCoeff() -
                                   random->Uniform(0.15, 0.3) * Range(*q);
                q->values = q->values.cwiseMin(top);
              }),
      OfJoint("spikes", {}, Simple,
              [](int j, Random* random, const Session&, Run* run) {
                Channel* q = Position(run, j);
                const double range = Range(*q);
                for (int i = 0; i < 5; ++i) {
                  q->values(random->Below(run->size()), 0) +=
                      random->Sign() * random->Uniform(0.7, 2.0) * range;
                }
              }),
      OfJoint("effort_spikes", {"spikes"}, Driven,
              [](int j, Random* random, const Session& s, Run* run) {
                auto tau =
                    run->effort.col(s.model.mechanism().joints[j].v_index);
                const double range = tau.maxCoeff() - tau.minCoeff();
                for (int i = 0; i < 5; ++i) {
                  tau[random->Below(run->size())] +=
                      random->Sign() * random->Uniform(1.5, 3.0) * range;
                }
              }),
      OfJoint("frozen", {}, Simple,
              [](int j, Random* random, const Session&, Run* run) {
                Channel* q = Position(run, j);
                const int n = run->size();
                // Where it moves at least a fifth of its range meanwhile.
                const double least = 0.2 * Range(*q);
                const int length = static_cast<int>(
                    0.2 * n / (run->t.back() - run->t.front()));
                for (int tries = 0; tries < 1000; ++tries) {
                  const int first = random->Below(n - length - 1);
                  const double value = q->values(first, 0);
                  if (std::abs(q->values(first + length, 0) - value) < least &&
                      tries < 999) {
                    continue;
                  }
                  q->values.middleRows(first, length).setConstant(value);
                  return;
                }
              }),
      OfJoint("drift", {}, felt,
              [](int j, Random* random, const Session&, Run* run) {
                const double rate = random->Sign() * random->Uniform(0.04, 0.1);
                Channel* q = Position(run, j);
                for (int k = 0; k < run->size(); ++k) {
                  q->values(k, 0) += rate * run->t[k];
                }
              }),
      {"still", {},
       [](const CleanCase& clean, std::uint64_t seed) -> Planted {
         std::mt19937_64 engine(seed);
         const CheckInput input = InputOf(clean.session);
         const std::vector<Series> motion = MotionSeries(input);
         Session planted = clean.session;
         for (size_t r = 0; r < planted.runs.size(); ++r) {
           planted.runs[r] = AfterRest(motion, clean.session.runs[r], &engine);
         }
         return planted;
       }},
      // Of so few samples both are true.
      {"slow_sampling", {"few_samples"},
       [](const CleanCase& clean, std::uint64_t) -> Planted {
         const CheckInput input = InputOf(clean.session);
         const std::vector<Series> motion = MotionSeries(input);
         Session planted = clean.session;
         for (size_t r = 0; r < planted.runs.size(); ++r) {
           const Run& run = clean.session.runs[r];
           // Two and a half samples a swing of the fastest channel.
           const double swings = Swings(clean.session.model.mechanism(), motion, run);
           const int stride = static_cast<int>(run.size() / (1.25 * swings));
           planted.runs[r] = Thinned(run, std::max(1, stride));
           // So slow a motion cannot be sampled too slowly: the reader takes
           // samples more than a second apart for milliseconds.
           if (MedianPeriod(planted.runs[r].t) > 1.0) return std::nullopt;
         }
         return planted;
       }},
      OfRun("few_samples",
            [](Random*, Run* run) {
              // Of the motion: six that are equal would be another fault.
              const int first = FastestStretch(*run, 6);
              *run = Slice(*run, first, first + 6);
            }),
      OfJoint("effort_idle", {}, Driven,
              [](int j, Random* random, const Session& s, Run* run) {
                const int v = s.model.mechanism().joints[j].v_index;
                run->effort.col(v) = OfAnotherExperiment(run->effort.col(v),
                                                         random);
              }),
      OfVelocity("velocity_flipped", {},
                 [](int j, const Session&, Run* run) {
                   ChannelOf(run, ChannelKind::kVelocity, j)->values *= -1.0;
                 },
                 1),
      OfVelocity("velocity_scale", {},
                 [](int j, const Session&, Run* run) {
                   ChannelOf(run, ChannelKind::kVelocity, j)->values *= 6.0;
                 },
                 1),
      OfVelocity("velocity_late", {},
                 [](int j, const Session&, Run* run) {
                   // Less than a sample cannot be seen in the changes.
                   const double late =
                       std::max(0.02, MedianPeriod(run->t));
                   ShiftChannel(run->t, -late,
                                ChannelOf(run, ChannelKind::kVelocity, j));
                 },
                 1),
      OfVelocity("velocities_swapped", {},
                 [](int, const Session& s, Run* run) {
                   const std::vector<int> list = Simple(s);
                   ChannelOf(run, ChannelKind::kVelocity, list[0])
                       ->values.swap(
                           ChannelOf(run, ChannelKind::kVelocity, list[1])
                               ->values);
                 },
                 2),
      OfModel("inertia_about_joint",
              [](const CleanCase& clean, int link) {
                const Inertial<double>& body =
                    clean.session.model.nominal().links[link];
                return body.mass * body.com.squaredNorm() > 1e-3 &&
                       clean.session.model_name != "video_pendulum" &&
                       clean.session.model_name != "emps";
              },
              [](Inertial<double>* body) {
                const Eigen::Vector3d& r = body->com;
                body->inertia +=
                    body->mass *
                    (r.squaredNorm() * Eigen::Matrix3d::Identity() -
                     r * r.transpose());
              }),
      OfModel("mass_in_grams",
              [](const CleanCase& clean, int link) {
                return clean.session.model.nominal().links[link].mass > 0.0 &&
                       !Driven(clean.session).empty() &&
                       clean.session.model_name != "emps";
              },
              [](Inertial<double>* body) { body->mass *= 1000.0; }),
  };
  return faults;
}

std::vector<Finding> CheckCase(const Session& session) {
  std::vector<Finding> findings;
  try {
    CheckTimes(session.runs, session.columns, session.model.mechanism());
    CheckMotion(session.runs);
  } catch (const InputError& error) {
    return {Unreadable(session.runs.front().name, error)};
  }
  return RunChecks(InputOf(session));
}

bool IsNamed(const Fault& fault, const std::vector<Finding>& findings) {
  if (findings.empty()) return false;
  const std::string& first = findings.front().fault;
  return first == fault.name ||
         std::find(fault.as_good.begin(), fault.as_good.end(), first) !=
             fault.as_good.end();
}

}  // namespace sysid
