/* A thruster by its table, straight lines between, behind a first-order lag of its input: FMI 3.0, co-simulation.
 * Types and signatures are those of fmi3PlatformTypes.h and fmi3FunctionTypes.h 3.0.2. Between two communication points
 * the input is held, for which the lag is exact. */
#include <math.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#if defined _WIN32
#define EXPORT __declspec(dllexport)
#else
#define EXPORT __attribute__((visibility("default")))
#endif

typedef void *fmi3Instance;
typedef void *fmi3InstanceEnvironment;
typedef void *fmi3FMUState;
typedef uint32_t fmi3ValueReference;
typedef double fmi3Float64;
typedef float fmi3Float32;
typedef bool fmi3Boolean;
typedef bool fmi3Clock;
typedef char fmi3Char;
typedef uint8_t fmi3Byte;
typedef const fmi3Char *fmi3String;
typedef const fmi3Byte *fmi3Binary;
typedef enum { fmi3OK, fmi3Warning, fmi3Discard, fmi3Error, fmi3Fatal } fmi3Status;
typedef int fmi3IntervalQualifier;
typedef int fmi3DependencyKind;

#define POINTS @POINTS@
static const double INPUT[POINTS] = {@INPUT@};
static const double THRUST[POINTS] = {@THRUST@};
static const double HALF_WIDTH[POINTS] = {@HALF_WIDTH@};
static const char TOKEN[] = "@TOKEN@";

enum { TIME, COMMAND, FORCE, WIDTH, TIME_CONSTANT, EFFICIENCY, VARIABLES };

typedef struct {
    double value[VARIABLES];
    double lagging;
    bool initialized;
} Thruster;

static double between(const double *table, double input) {
    int i = 1;
    if (!(input > INPUT[0])) return table[0];
    if (!(input < INPUT[POINTS - 1])) return table[POINTS - 1];
    while (INPUT[i] < input) ++i;
    return table[i - 1] + (input - INPUT[i - 1]) * (table[i] - table[i - 1]) / (INPUT[i] - INPUT[i - 1]);
}

static void settle(Thruster *it) {
    it->value[FORCE] = it->value[EFFICIENCY] * between(THRUST, it->lagging);
    it->value[WIDTH] = it->value[EFFICIENCY] * between(HALF_WIDTH, it->lagging);
}

static void begin(Thruster *it) {
    memset(it, 0, sizeof *it);
    it->value[TIME_CONSTANT] = @TIME_CONSTANT@;
    it->value[EFFICIENCY] = 1.0;
    settle(it);
}

EXPORT const char *fmi3GetVersion(void) { return "3.0"; }

EXPORT fmi3Status fmi3SetDebugLogging(fmi3Instance i, fmi3Boolean on, size_t n, const fmi3String categories[]) {
    (void)i; (void)on; (void)n; (void)categories;
    return fmi3OK;
}

EXPORT fmi3Instance fmi3InstantiateCoSimulation(
    fmi3String name, fmi3String token, fmi3String resources, fmi3Boolean visible, fmi3Boolean logging,
    fmi3Boolean events, fmi3Boolean early, const fmi3ValueReference required[], size_t count,
    fmi3InstanceEnvironment environment, void *log, void *update) {
    Thruster *it;
    (void)name; (void)resources; (void)visible; (void)logging; (void)events; (void)early; (void)required; (void)count;
    (void)environment; (void)log; (void)update;
    if (token == NULL || strcmp(token, TOKEN) != 0) return NULL;
    it = malloc(sizeof *it);
    if (it != NULL) begin(it);
    return it;
}

EXPORT fmi3Instance fmi3InstantiateModelExchange(
    fmi3String a, fmi3String b, fmi3String c, fmi3Boolean d, fmi3Boolean e, fmi3InstanceEnvironment f, void *g) {
    (void)a; (void)b; (void)c; (void)d; (void)e; (void)f; (void)g;
    return NULL;
}

EXPORT fmi3Instance fmi3InstantiateScheduledExecution(
    fmi3String a, fmi3String b, fmi3String c, fmi3Boolean d, fmi3Boolean e, fmi3InstanceEnvironment f, void *g,
    void *h, void *i, void *j) {
    (void)a; (void)b; (void)c; (void)d; (void)e; (void)f; (void)g; (void)h; (void)i; (void)j;
    return NULL;
}

EXPORT void fmi3FreeInstance(fmi3Instance i) { free(i); }

EXPORT fmi3Status fmi3EnterInitializationMode(
    fmi3Instance i, fmi3Boolean tolerant, fmi3Float64 tolerance, fmi3Float64 start, fmi3Boolean stops, fmi3Float64 stop) {
    (void)tolerant; (void)tolerance; (void)stops; (void)stop;
    ((Thruster *)i)->value[TIME] = start;
    return fmi3OK;
}

EXPORT fmi3Status fmi3ExitInitializationMode(fmi3Instance i) {
    Thruster *it = i;
    it->initialized = true;
    if (it->value[TIME_CONSTANT] <= 0.0) it->lagging = it->value[COMMAND];
    settle(it);
    return fmi3OK;
}

EXPORT fmi3Status fmi3EnterEventMode(fmi3Instance i) { (void)i; return fmi3OK; }
EXPORT fmi3Status fmi3EnterStepMode(fmi3Instance i) { (void)i; return fmi3OK; }
EXPORT fmi3Status fmi3EnterConfigurationMode(fmi3Instance i) { (void)i; return fmi3OK; }
EXPORT fmi3Status fmi3ExitConfigurationMode(fmi3Instance i) { (void)i; return fmi3OK; }
EXPORT fmi3Status fmi3EnterContinuousTimeMode(fmi3Instance i) { (void)i; return fmi3Error; }
EXPORT fmi3Status fmi3Terminate(fmi3Instance i) { (void)i; return fmi3OK; }
EXPORT fmi3Status fmi3Reset(fmi3Instance i) { begin(i); return fmi3OK; }

EXPORT fmi3Status fmi3GetFloat64(
    fmi3Instance i, const fmi3ValueReference which[], size_t n, fmi3Float64 values[], size_t m) {
    size_t k;
    if (n != m) return fmi3Error;
    for (k = 0; k < n; ++k) {
        if (which[k] >= VARIABLES) return fmi3Error;
        values[k] = ((Thruster *)i)->value[which[k]];
    }
    return fmi3OK;
}

EXPORT fmi3Status fmi3SetFloat64(
    fmi3Instance i, const fmi3ValueReference which[], size_t n, const fmi3Float64 values[], size_t m) {
    Thruster *it = i;
    size_t k;
    if (n != m) return fmi3Error;
    for (k = 0; k < n; ++k) {
        if (which[k] != COMMAND && which[k] != TIME_CONSTANT && which[k] != EFFICIENCY) return fmi3Error;
        if (!isfinite(values[k]) || (which[k] != COMMAND && values[k] < 0.0)) return fmi3Error;
        it->value[which[k]] = values[k];
    }
    if (it->value[TIME_CONSTANT] <= 0.0) it->lagging = it->value[COMMAND];
    settle(it);
    return fmi3OK;
}

EXPORT fmi3Status fmi3DoStep(
    fmi3Instance i, fmi3Float64 now, fmi3Float64 step, fmi3Boolean keeps, fmi3Boolean *event, fmi3Boolean *terminate,
    fmi3Boolean *early, fmi3Float64 *reached) {
    Thruster *it = i;
    double tau = it->value[TIME_CONSTANT];
    (void)keeps;
    if (!(step > 0.0)) return fmi3Error;
    it->lagging += (tau > 0.0 ? -expm1(-step / tau) : 1.0) * (it->value[COMMAND] - it->lagging);
    it->value[TIME] = now + step;
    settle(it);
    *event = false;
    *terminate = false;
    *early = false;
    *reached = it->value[TIME];
    return fmi3OK;
}

/* What this model has not: other types of variables, clocks, states to keep, derivatives, partitions. FMI has each of
 * these functions in every FMU. */
#define HAS_NOT(NAME, ...) \
    EXPORT fmi3Status NAME(__VA_ARGS__) { return fmi3Error; }
#define REFERENCES const fmi3ValueReference w[], size_t n
#define HAS_NO_TYPE(NAME, TYPE)                                                                                        \
    HAS_NOT(fmi3Get##NAME, fmi3Instance i, REFERENCES, TYPE v[], size_t m)                                             \
    HAS_NOT(fmi3Set##NAME, fmi3Instance i, REFERENCES, const TYPE v[], size_t m)
HAS_NO_TYPE(Float32, fmi3Float32)
HAS_NO_TYPE(Int8, int8_t)
HAS_NO_TYPE(UInt8, uint8_t)
HAS_NO_TYPE(Int16, int16_t)
HAS_NO_TYPE(UInt16, uint16_t)
HAS_NO_TYPE(Int32, int32_t)
HAS_NO_TYPE(UInt32, uint32_t)
HAS_NO_TYPE(Int64, int64_t)
HAS_NO_TYPE(UInt64, uint64_t)
HAS_NO_TYPE(Boolean, fmi3Boolean)
HAS_NO_TYPE(String, fmi3String)
HAS_NOT(fmi3GetBinary, fmi3Instance i, REFERENCES, size_t sizes[], fmi3Binary v[], size_t m)
HAS_NOT(fmi3SetBinary, fmi3Instance i, REFERENCES, const size_t sizes[], const fmi3Binary v[], size_t m)
HAS_NOT(fmi3GetClock, fmi3Instance i, REFERENCES, fmi3Clock v[])
HAS_NOT(fmi3SetClock, fmi3Instance i, REFERENCES, const fmi3Clock v[])
HAS_NOT(fmi3GetNumberOfVariableDependencies, fmi3Instance i, fmi3ValueReference w, size_t *n)
HAS_NOT(fmi3GetVariableDependencies, fmi3Instance i, fmi3ValueReference w, size_t e[], fmi3ValueReference d[],
        size_t f[], fmi3DependencyKind k[], size_t n)
HAS_NOT(fmi3GetFMUState, fmi3Instance i, fmi3FMUState *state)
HAS_NOT(fmi3SetFMUState, fmi3Instance i, fmi3FMUState state)
HAS_NOT(fmi3FreeFMUState, fmi3Instance i, fmi3FMUState *state)
HAS_NOT(fmi3SerializedFMUStateSize, fmi3Instance i, fmi3FMUState state, size_t *size)
HAS_NOT(fmi3SerializeFMUState, fmi3Instance i, fmi3FMUState state, fmi3Byte bytes[], size_t size)
HAS_NOT(fmi3DeserializeFMUState, fmi3Instance i, const fmi3Byte bytes[], size_t size, fmi3FMUState *state)
#define DERIVATIVE                                                                                                     \
    fmi3Instance i, const fmi3ValueReference u[], size_t n, const fmi3ValueReference k[], size_t m,                    \
        const fmi3Float64 seed[], size_t s, fmi3Float64 out[], size_t o
HAS_NOT(fmi3GetDirectionalDerivative, DERIVATIVE)
HAS_NOT(fmi3GetAdjointDerivative, DERIVATIVE)
HAS_NOT(fmi3GetIntervalDecimal, fmi3Instance i, REFERENCES, fmi3Float64 v[], fmi3IntervalQualifier q[])
HAS_NOT(fmi3GetIntervalFraction, fmi3Instance i, REFERENCES, uint64_t c[], uint64_t r[], fmi3IntervalQualifier q[])
HAS_NOT(fmi3GetShiftDecimal, fmi3Instance i, REFERENCES, fmi3Float64 v[])
HAS_NOT(fmi3GetShiftFraction, fmi3Instance i, REFERENCES, uint64_t c[], uint64_t r[])
HAS_NOT(fmi3SetIntervalDecimal, fmi3Instance i, REFERENCES, const fmi3Float64 v[])
HAS_NOT(fmi3SetIntervalFraction, fmi3Instance i, REFERENCES, const uint64_t c[], const uint64_t r[])
HAS_NOT(fmi3SetShiftDecimal, fmi3Instance i, REFERENCES, const fmi3Float64 v[])
HAS_NOT(fmi3SetShiftFraction, fmi3Instance i, REFERENCES, const uint64_t c[], const uint64_t r[])
HAS_NOT(fmi3EvaluateDiscreteStates, fmi3Instance i)
HAS_NOT(fmi3UpdateDiscreteStates, fmi3Instance i, fmi3Boolean *a, fmi3Boolean *b, fmi3Boolean *c, fmi3Boolean *d,
        fmi3Boolean *e, fmi3Float64 *t)
HAS_NOT(fmi3CompletedIntegratorStep, fmi3Instance i, fmi3Boolean keeps, fmi3Boolean *event, fmi3Boolean *terminate)
HAS_NOT(fmi3SetTime, fmi3Instance i, fmi3Float64 time)
HAS_NOT(fmi3SetContinuousStates, fmi3Instance i, const fmi3Float64 x[], size_t n)
HAS_NOT(fmi3GetContinuousStateDerivatives, fmi3Instance i, fmi3Float64 x[], size_t n)
HAS_NOT(fmi3GetEventIndicators, fmi3Instance i, fmi3Float64 x[], size_t n)
HAS_NOT(fmi3GetContinuousStates, fmi3Instance i, fmi3Float64 x[], size_t n)
HAS_NOT(fmi3GetNominalsOfContinuousStates, fmi3Instance i, fmi3Float64 x[], size_t n)
HAS_NOT(fmi3GetNumberOfEventIndicators, fmi3Instance i, size_t *n)
HAS_NOT(fmi3GetNumberOfContinuousStates, fmi3Instance i, size_t *n)
HAS_NOT(fmi3GetOutputDerivatives, fmi3Instance i, REFERENCES, const int32_t o[], fmi3Float64 v[], size_t m)
HAS_NOT(fmi3ActivateModelPartition, fmi3Instance i, fmi3ValueReference c, fmi3Float64 t)
