#include "sysid/io/decompress.h"

#include <bzlib.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <lz4frame.h>

#include <random>
#include <string>
#include <vector>

#include "sysid/io/bag_file.h"
#include "tests/support/error_text.h"
#include "tests/sysid/io/bag_writer.h"
#include "tests/sysid/io/read_columns.h"
#include "tests/sysid/io/scratch_file.h"

namespace sysid {
namespace {

std::string Bzip2(std::string plain) {
  std::vector<char> out(plain.size() + plain.size() / 50 + 1000);
  unsigned size = static_cast<unsigned>(out.size());
  EXPECT_EQ(
      BZ2_bzBuffToBuffCompress(out.data(), &size, plain.data(),
                               static_cast<unsigned>(plain.size()), 9, 0, 0),
      BZ_OK);
  return std::string(out.data(), size);
}

std::string Lz4(const std::string& plain) {
  std::vector<char> out(LZ4F_compressFrameBound(plain.size(), nullptr));
  const size_t size = LZ4F_compressFrame(out.data(), out.size(), plain.data(),
                                         plain.size(), nullptr);
  EXPECT_FALSE(LZ4F_isError(size));
  return std::string(out.data(), size);
}

// Longer than a block, half of it noise.
std::string Text() {
  std::mt19937 random(1);
  std::string text(700000, 'a');
  for (size_t i = 0; i < text.size() / 2; ++i) {
    text[i] = static_cast<char>(random());
  }
  return text;
}

using Decompress = std::string (*)(std::string_view, size_t, std::string*);

void ExpectMethod(const std::string& packed, Decompress decompress) {
  const std::string text = Text();
  std::string out;
  EXPECT_EQ(decompress(packed, text.size(), &out), "");
  EXPECT_EQ(out, text);
  const std::string claim = "it does not come to the size that it claims";
  EXPECT_EQ(decompress(packed, text.size() + 1, &out), claim);
  EXPECT_NE(decompress(packed, text.size() - 1, &out), "");
  EXPECT_NE(decompress(packed.substr(0, packed.size() / 2), text.size(), &out),
            "");
  EXPECT_NE(decompress("nonsense", text.size(), &out), "");
  EXPECT_NE(decompress("", text.size(), &out), "");
  // A small text that claims much: what is allocated follows the text.
  std::string small;
  EXPECT_NE(decompress("nonsense", size_t{1} << 30, &small), "");
  EXPECT_LT(small.capacity(), size_t{1} << 20);
}

TEST(DecompressTest, Bzip2) { ExpectMethod(Bzip2(Text()), DecompressBzip2); }

TEST(DecompressTest, Lz4) { ExpectMethod(Lz4(Text()), DecompressLz4); }

TEST(DecompressTest, BagsMayBeCompressed) {
  using W = BagWriter;
  std::string records = W::Connection(0, "/js", "sensor_msgs/JointState");
  for (int i = 0; i < 500; ++i) {
    records += W::Message(0, 1, W::JointState(10 + i, 0, {"a"}, {0.5 * i}));
  }
  for (const bool bzip2 : {true, false}) {
    const std::string packed = bzip2 ? Bzip2(records) : Lz4(records);
    const std::string kind = bzip2 ? "bz2" : "lz4";
    const ScratchFile file("run.bag",
                           W::Bag(W::Chunk(kind, packed, records.size())));
    const Table table =
        ReadColumns(*OpenBagFile(ByteSource(file.path()), ""), {0, 1});
    ASSERT_EQ(table.rows(), 500);
    EXPECT_EQ(table.columns[0][499], 499.0);
    EXPECT_EQ(table.columns[1][499], 249.5);
    const ScratchFile wrong("wrong.bag",
                            W::Bag(W::Chunk(kind, packed, 1000000000)));
    EXPECT_THAT(ErrorText([&] { OpenBagFile(ByteSource(wrong.path()), ""); }),
                testing::HasSubstr("a chunk cannot be decompressed: it does "
                                   "not come to the size that it claims"));
  }
}

}  // namespace
}  // namespace sysid
