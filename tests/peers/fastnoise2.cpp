// fastnoise2 SIDE REPEATS: times FastNoise2 on one thread, as noise/src/main.rs does other libraries.
#include <FastNoise/FastNoise.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <vector>

static double processor_ns() {
    timespec time;
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
    return 1e9 * time.tv_sec + time.tv_nsec;
}

template <class Noise>
static void bench(const char* kernel, int octaves, const Noise& noise, int side, int repeats) {
    std::vector<float> out(size_t(side) * side);
    std::vector<double> times;
    for (int run = 0; run <= repeats; run++) {
        double start = processor_ns();
        noise->GenUniformGrid2D(out.data(), 0.f, 0.f, side, side, 1.f, 1.f, 7);
        if (run > 0) times.push_back((processor_ns() - start) / double(out.size()));
    }
    std::sort(times.begin(), times.end());
    std::printf("%s %d FastNoise2-%s %.3f\n", kernel, octaves, FASTNOISE2_VERSION, times[repeats / 2]);
}

int main(int count, char** args) {
    if (count != 3) return 1;
    int side = std::atoi(args[1]), repeats = std::atoi(args[2]);
    auto plain = FastNoise::New<FastNoise::Perlin>();
    plain->SetScale(64.f);
    bench("perlin", 1, plain, side, repeats);
    auto first = FastNoise::New<FastNoise::Perlin>();
    first->SetScale(1024.f);
    auto sum = FastNoise::New<FastNoise::FractalFBm>();
    sum->SetSource(first);
    sum->SetOctaveCount(8);
    bench("perlin", 8, sum, side, repeats);
    for (int octaves : {8, 12}) {
        auto ridged = FastNoise::New<FastNoise::FractalRidged>();
        ridged->SetSource(first);
        ridged->SetOctaveCount(octaves);
        bench("ridged", octaves, ridged, side, repeats);
    }
    auto cellular = FastNoise::New<FastNoise::CellularDistance>();
    cellular->SetScale(64.f);
    bench("cellular", 1, cellular, side, repeats);
}
