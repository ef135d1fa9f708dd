#include <utility>

#include "sysid/estimation/evaluation.h"

namespace sysid {
namespace {

std::string PackedSegments(const std::vector<SegmentError>& segments) {
  Packer packer;
  for (const SegmentError& segment : segments) {
    packer.Put(segment.trajectory);
    packer.Put(segment.t_start);
    packer.Put(segment.t_end);
    packer.Put(segment.normalized_rms);
    packer.Put(segment.squares);
    packer.Put(segment.dof);
  }
  return packer.bytes();
}

std::string PackedOpen(const std::vector<OpenError>& open) {
  Packer packer;
  for (const OpenError& run : open) {
    packer.Put(run.trajectory);
    packer.Put(run.duration_s);
    packer.Put(static_cast<double>(run.channels.size()));
    for (const OpenError::Channel& channel : run.channels) {
      packer.Put(channel.name);
      packer.Put(channel.unit);
      packer.Put(channel.rms);
      packer.Put(channel.fit_percent);
    }
  }
  return packer.bytes();
}

}  // namespace

void GatherErrors(const Processes& all, RunErrors* errors) {
  if (all.size() == 1) return;
  const std::vector<std::string> texts =
      all.Gather(PackedSegments(errors->segments));
  if (all.rank() != 0) return;
  errors->segments.clear();
  for (const std::string& bytes : texts) {
    for (Unpacker unpacker(bytes); !unpacker.AtEnd();) {
      SegmentError segment;
      segment.trajectory = unpacker.Text();
      segment.t_start = unpacker.Number();
      segment.t_end = unpacker.Number();
      segment.normalized_rms = unpacker.Number();
      segment.squares = unpacker.Number();
      segment.dof = unpacker.Number();
      errors->segments.push_back(std::move(segment));
    }
  }
}

void GatherOpen(const Processes& all, std::vector<OpenError>* open) {
  if (all.size() == 1) return;
  const std::vector<std::string> texts = all.Gather(PackedOpen(*open));
  if (all.rank() != 0) return;
  open->clear();
  for (const std::string& bytes : texts) {
    for (Unpacker unpacker(bytes); !unpacker.AtEnd();) {
      OpenError run;
      run.trajectory = unpacker.Text();
      run.duration_s = unpacker.Number();
      run.channels.resize(unpacker.Count());
      for (OpenError::Channel& channel : run.channels) {
        channel.name = unpacker.Text();
        channel.unit = unpacker.Text();
        channel.rms = unpacker.Number();
        channel.fit_percent = unpacker.Number();
      }
      open->push_back(std::move(run));
    }
  }
}

}  // namespace sysid
