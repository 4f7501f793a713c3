#include "pipeline/volume/class_table.h"

#include <gtest/gtest.h>

namespace scanrig {
namespace {
TEST(ClassTable, Placeholder) { EXPECT_EQ(classify({}, 1.0F).voxel_class, VoxelClass::unseen); }
}  // namespace
}  // namespace scanrig
