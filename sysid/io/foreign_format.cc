#include "sysid/io/foreign_format.h"

#include <string>
#include <string_view>

#include "models/error.h"

namespace sysid {
namespace {

using std::string_view_literals::operator""sv;

// "FILE" in a hint is the file's path; its columns are then #1, #2, ...
struct ForeignFormat {
  std::string_view begins;
  std::string_view holds;  // within the first bytes; "" anything
  std::string_view what;
  std::string_view hint;
};

constexpr size_t kLook = 4096;  // bytes

constexpr std::string_view kOfBag =
    "play it (ros2 bag play FILE) and write the joint states beside it: ros2 "
    "topic echo --csv /joint_states > run.csv";
constexpr std::string_view kOfNumpy =
    "python3 -c \"import numpy as np; f = np.load('FILE'); "
    "np.savetxt('run.csv', np.column_stack([f[k] for k in f.files]), "
    "delimiter=',')\" writes its arrays side by side";
constexpr std::string_view kOfTorch =
    "python3 -c \"import torch, numpy as np; f = torch.load('FILE'); "
    "np.savetxt('run.csv', np.column_stack([f[k] for k in f]), "
    "delimiter=',')\" writes a dictionary of tensors side by side";
constexpr std::string_view kOfSheet =
    "save the sheet as CSV (UTF-8) from the program that wrote it";

constexpr ForeignFormat kFormats[] = {
    {"\x93NUMPY"sv, "", "a NumPy array (.npy)",
     "python3 -c \"import numpy as np; np.savetxt('run.csv', np.load('FILE'), "
     "delimiter=',')\""},
    {"PK\x03\x04"sv, ".npy", "an archive of NumPy arrays (.npz)", kOfNumpy},
    {"PK\x03\x04"sv, "data.pkl", "a file of PyTorch (.pt)", kOfTorch},
    {"PK\x03\x04"sv, "[Content_Types].xml", "a workbook (.xlsx)", kOfSheet},
    {"PK\x03\x04"sv, "opendocument.spreadsheet", "a workbook (.ods)", kOfSheet},
    {"PK\x03\x04"sv, "", "a ZIP archive", "unpack it: unzip FILE"},
    {"\x80\x02\x8a\x0a"sv, "", "a file of PyTorch (.pt)", kOfTorch},
    {"\x80\x03"sv, "", "a pickle of Python", kOfTorch},
    {"\x80\x04"sv, "", "a pickle of Python", kOfTorch},
    {"SQLite format 3\0"sv, "topics", "a ROS 2 bag (.db3)", kOfBag},
    {"SQLite format 3\0"sv, "", "a database of SQLite",
     "export the table: sqlite3 -header -csv FILE 'select * from TABLE' > "
     "run.csv"},
    {"\x89MCAP"sv, "", "a recording in MCAP", kOfBag},
    {"\x89HDF\r\n"sv, "", "an HDF5 file",
     "python3 -c \"import h5py, numpy as np; f = h5py.File('FILE'); "
     "np.savetxt('run.csv', np.column_stack([f[k] for k in f]), "
     "delimiter=',')\" writes its data sets side by side"},
    {"PAR1"sv, "", "a Parquet file",
     "python3 -c \"import pandas; pandas.read_parquet('FILE')"
     ".to_csv('run.csv', index=False)\""},
    {"\x1f\x8b"sv, "", "compressed by gzip", "gunzip FILE"},
    {"ULog\x01\x12\x35"sv, "", "a log of PX4 (ULog)", "ulog2csv FILE"},
    {"{"sv, "", "JSON",
     "where each line is an object of numbers: python3 -c \"import csv, json; "
     "r = [json.loads(s) for s in open('FILE')]; "
     "w = csv.DictWriter(open('run.csv', 'w'), r[0]); w.writeheader(); "
     "w.writerows(r)\""},
    {"<?xml"sv, "<robot", "a model (URDF), no recording", "give it by --model"},
    {"<robot"sv, "", "a model (URDF), no recording", "give it by --model"},
};

std::string WithFile(std::string_view hint, const std::string& path) {
  constexpr std::string_view kFile = "FILE";
  std::string text(hint);
  const size_t at = text.find(kFile);
  return at == text.npos ? text : text.replace(at, kFile.size(), path);
}

}  // namespace

void RefuseForeignFormat(ByteSource* source) {
  for (const ForeignFormat& format : kFormats) {
    if (source->Peek(format.begins.size()) != format.begins) continue;
    const std::string_view head = source->Peek(kLook);
    if (head.find(format.holds) == head.npos) continue;
    throw InputError(
        source->path(),
        "is " + std::string(format.what) + ", which is not read here",
        WithFile(format.hint, source->path()));
  }
}

}  // namespace sysid
