#include "drivers/camera/image_memory.h"

#include <algorithm>
#include <deque>
#include <memory>
#include <mutex>
#include <span>

namespace scanrig {
namespace {

/// Allocator that cv::Mat uses, see cv::MatAllocator.
class ImageMemory final : public cv::MatAllocator {
 public:
  cv::UMatData* allocate(int dims, const int* sizes, int type, void* data, std::size_t* step, cv::AccessFlag,
                         cv::UMatUsageFlags) const override {
    if (data) CV_Error(cv::Error::StsNotImplemented, "memory of another owner");
    std::size_t bytes = CV_ELEM_SIZE(type);
    for (int i = dims - 1; i >= 0; --i) {
      if (step) step[i] = bytes;
      bytes *= static_cast<std::size_t>(sizes[i]);
    }
    auto block = std::make_unique<cv::UMatData>(this);
    block->data = block->origdata = take(bytes);
    block->size = bytes;
    return block.release();
  }
  bool allocate(cv::UMatData* block, cv::AccessFlag, cv::UMatUsageFlags) const override { return block != nullptr; }

  void deallocate(cv::UMatData* block) const override {
    if (!block) return;
    keep({block->origdata, block->size});
    delete block;
  }

 private:
  using Block = std::span<std::uint8_t>;

  std::uint8_t* take(std::size_t bytes) const {
    {
      const std::scoped_lock lock(mutex_);
      // The block released last is the likeliest to be in a cache.
      const auto found = std::find_if(free_.rbegin(), free_.rend(), [&](Block block) { return block.size() == bytes; });
      if (found != free_.rend()) {
        auto* data = found->data();
        free_.erase(std::next(found).base());
        return data;
      }
    }
    return static_cast<std::uint8_t*>(cv::fastMalloc(bytes));
  }

  void keep(Block block) const {
    std::unique_lock lock(mutex_);
    free_.push_back(block);
    if (free_.size() <= kImagesKept) return;
    const Block oldest = free_.front();
    free_.pop_front();
    lock.unlock();
    cv::fastFree(oldest.data());
  }

  mutable std::mutex mutex_;
  mutable std::deque<Block> free_;
};

}  // namespace

cv::Mat new_image(cv::Size size, int type) {
  static auto& memory = *new ImageMemory;  // outlives every image
  cv::Mat image;
  image.allocator = &memory;
  image.create(size, type);
  return image;
}

cv::Mat copy_of(const cv::Mat& image) {
  cv::Mat copy = new_image(image.size(), image.type());
  image.copyTo(copy);
  return copy;
}

}  // namespace scanrig
