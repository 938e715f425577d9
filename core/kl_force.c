/* kl_force.c - the forces of elements and linkages, from an evaluation. */
#include "kl_force.h"

#include "kl_math.h"
#include "kl_rates.h"
#include "kl_reach.h"

enum lane { COORDINATE = 0, RATE = 1 };

static double sum_of(const struct kl_reach *reach, const kl_both *motion, enum lane lane) {
    double sum = 0.0;
    for (uint32_t t = 0; t < reach->n; t++) {
        sum += reach->factor[t] * (double)motion[reach->coordinate[t]][lane];
    }
    return sum;
}

static kl_real linear(const struct kl_reach *reach, const kl_both *motion, double k, double c) {
    return (kl_real)(k * sum_of(reach, motion, COORDINATE) + c * sum_of(reach, motion, RATE));
}

/* Places of an element's parts among the struts of their kinds, which are in the elements' order. */
struct places {
    uint32_t slip;
    uint32_t stop;
    uint32_t damper;
    uint32_t actuator;
};

static struct places count_before(const struct kl_vehicle_def *def, uint32_t i) {
    struct places n = {0, 0, 0, 0};
    for (uint32_t j = 0; j < i; j++) {
        const struct kl_element_def *e = &def->elements[j];
        n.slip += e->slip.k > 0.0 ? 1u : 0u;
        n.stop += e->stop.n > 0 ? 1u : 0u;
        n.damper += e->damper.n > 0 ? 1u : 0u;
        n.actuator += e->actuator > 0 ? 1u : 0u;
    }
    return n;
}

void kl_element_force(const struct kl_vehicle_def *def, const struct kl_model *model, uint32_t i,
                      struct kl_element_force *force, const struct kl_work *work) {
    const struct kl_evaluation *e = (const struct kl_evaluation *)(const void *)work;
    const struct kl_element_def *element = &def->elements[i];
    const struct kl_struts *struts = &model->struts;
    double axle_z_m[KL_MAX_WHEELSETS];
    for (uint32_t w = 0; w < def->n_wheelsets; w++) {
        axle_z_m[w] = -(double)model->pairs[model->wheelsets[w].pair].radius_m;
    }
    const struct kl_assembly as = {def, axle_z_m, NULL};
    struct kl_reach reach;
    for (int axis = 0; axis < 6; axis++) {
        kl_reach_element(&as, element, (enum kl_along)axis, &reach);
        force->axis[axis] = linear(&reach, e->motion, element->k[axis], element->c[axis]);
    }
    force->line_N = KL_R(0);
    if (element->line_k_N_m > 0.0 || element->line_c_Ns_m > 0.0) {
        kl_reach_element(&as, element, KL_ALONG_LINE, &reach);
        force->line_N = linear(&reach, e->motion, element->line_k_N_m, element->line_c_Ns_m);
    }
    struct places at = count_before(def, i);
    at.stop += struts->n_slips;
    at.damper += struts->n_slips + struts->n_stops;
    at.actuator += struts->n_slips + struts->n_stops + struts->n_dampers;
    const struct kl_strut_view view = {struts, e->motion, &e->slipped, &e->kept};
    force->slip = element->slip.k > 0.0 ? kl_strut_force(&view, at.slip) : KL_R(0);
    force->stop = element->stop.n > 0 ? kl_strut_force(&view, at.stop) : KL_R(0);
    force->damper = element->damper.n > 0 ? kl_strut_force(&view, at.damper) : KL_R(0);
    force->actuator = element->actuator > 0 ? kl_strut_force(&view, at.actuator) : KL_R(0);
}

kl_real kl_linkage_force(const struct kl_vehicle_def *def, const struct kl_model *model, uint32_t i,
                         const struct kl_work *work) {
    const struct kl_evaluation *e = (const struct kl_evaluation *)(const void *)work;
    struct kl_reach reach;
    struct kl_linkage_rates rates;
    kl_linkage_rates(def, i, &rates);
    kl_reach_linkage(def, &def->linkages[i], &reach);
    const kl_real f = linear(&reach, e->motion, rates.k, rates.c);
    if (!def->linkages[i].rigid) {
        return f;
    }
    uint32_t strut = count_before(def, def->n_elements).slip;
    for (uint32_t before = 0; before < i; before++) {
        strut += def->linkages[before].rigid ? 1u : 0u;
    }
    const struct kl_strut_view view = {&model->struts, e->motion, &e->slipped, &e->kept};
    return f + kl_strut_force(&view, strut);
}
