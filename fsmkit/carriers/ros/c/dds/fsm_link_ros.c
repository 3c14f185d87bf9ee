/* fsm_link_ros.c: see fsm_link_ros.h. */
#define _POSIX_C_SOURCE 200809L

#include "fsm_link_ros.h"

#include "fsm_frames.h"

#include <errno.h>
#include <sched.h>
#include <string.h>
#include <time.h>

typedef std_msgs_msg_dds__UInt8MultiArray_ message;

enum { BURST = 256, MOST = 16, TAG = 8 };
#define PATROL DDS_MSECS(1) /* for frames that seeded faults delay, and for a ring that is full */

static void count(fsm_link_ros *ros, fsm_link_ros_counter what)
{
    fsm_shared_write(&ros->counts[what], (FSM_INDEX)(fsm_shared_own(&ros->counts[what]) + 1u));
}

/* ---- to the topic: the sender's --------------------------------------------------------------- */

static void *run_sender(void *argument)
{
    fsm_link_ros *ros = argument;
    for (;;) {
        fsm_link_frame frame;
        while (sem_wait(&ros->work) != 0) {
            ;
        }
        if (fsm_shared_read(&ros->stop) != 0u) {
            return NULL;
        }
        while (fsm_link_next(ros->link, &frame)) {
            message m;
            memset(&m, 0, sizeof m);
            m.data._buffer = frame.bytes;
            m.data._length = m.data._maximum = frame.length;
            count(ros, dds_write(ros->writer, &m) == DDS_RETCODE_OK ? FSM_LINK_ROS_SENT
                                                                    : FSM_LINK_ROS_UNSENT);
        }
    }
}

static void wake(void *carrier, fsm_link *link)
{
    fsm_link_ros *ros = carrier;
    (void)link;
    (void)sem_post(&ros->work);
}

/* ---- from the topics: the receiver's ---------------------------------------------------------- */

/* Hand over what has come of a peer; false if the link has no room for events. */
static bool receive(fsm_link_ros *ros, uint8_t peer)
{
    for (unsigned some = 0u; some < BURST; some++) {
        dds_sample_info_t info;
        void *held = NULL;
        if (fsm_link_room(ros->link) == 0u) {
            return false;
        }
        if (dds_take(ros->readers[peer], &held, &info, 1u, 1u) <= 0) {
            return true;
        }
        if (info.valid_data) { /* else a publisher has gone */
            const message *m = held;
            count(ros, FSM_LINK_ROS_RECEIVED);
            (void)fsm_link_arrive(ros->link, peer, m->data._buffer, m->data._length);
        }
        (void)dds_return_loan(ros->readers[peer], &held, 1);
    }
    return true;
}

static void *run_receiver(void *argument)
{
    fsm_link_ros *ros = argument;
    while (fsm_shared_read(&ros->stop) == 0u) {
        bool has_room = true;
        for (uint8_t peer = 0u; peer < ros->link->map->nodes; peer++) {
            if (ros->readers[peer] > 0) {
                has_room = receive(ros, peer) && has_room;
            }
        }
        if (ros->link->faults != NULL) {
            fsm_link_pass_time(ros->link);
        }
        if (!has_room) {
            dds_sleepfor(PATROL); /* what waits would end any wait for more */
        } else {
            dds_duration_t most = ros->link->faults != NULL ? PATROL : DDS_INFINITY;
            (void)dds_waitset_wait(ros->waitset, NULL, 0u, most);
        }
    }
    return NULL;
}

/* ---- who listens ------------------------------------------------------------------------------ */

/* The discovery data of a node: the hash of its map, and its session. */
static void tag_of(const fsm_link *link, uint32_t session, uint8_t *tag)
{
    fsm_link_put_bytes(tag, link->map->hash, 4u);
    fsm_link_put_bytes(tag + 4, session, 4u);
}

/* Whether a publisher is the node in this session, or in any for 0. */
static bool is_node(const fsm_link *link, uint32_t session, const dds_builtintopic_endpoint_t *found)
{
    uint8_t wanted[TAG];
    void *given = NULL;
    size_t size = 0u;
    bool is_so;
    tag_of(link, session, wanted);
    if (!dds_qget_userdata(found->qos, &given, &size)) {
        return false;
    }
    is_so = size == TAG && memcmp(given, wanted, session != 0u ? TAG : TAG / 2u) == 0;
    dds_free(given);
    return is_so;
}

/* Whether a program has subscribed to the topic of this node. */
static bool subscribes(const fsm_link_ros *ros, const dds_guid_t *program)
{
    dds_instance_handle_t handles[MOST * FSM_LINK_NODES];
    int found = dds_get_matched_subscriptions(ros->writer, handles, MOST * FSM_LINK_NODES);
    bool is_one = false;
    for (int place = 0; place < found && place < MOST * FSM_LINK_NODES && !is_one; place++) {
        dds_builtintopic_endpoint_t *each =
            dds_get_matched_subscription_data(ros->writer, handles[place]);
        if (each != NULL) {
            is_one = memcmp(each->participant_key.v, program->v, sizeof program->v) == 0;
            dds_builtintopic_free_endpoint(each);
        }
    }
    return is_one;
}

static bool listens(const fsm_link_ros *ros, uint8_t peer, uint32_t session)
{
    dds_instance_handle_t handles[MOST];
    int found = dds_get_matched_publications(ros->readers[peer], handles, MOST);
    bool is_so = false;
    for (int place = 0; place < found && place < MOST && !is_so; place++) {
        dds_builtintopic_endpoint_t *each =
            dds_get_matched_publication_data(ros->readers[peer], handles[place]);
        if (each != NULL) {
            is_so = is_node(ros->link, session, each) && subscribes(ros, &each->participant_key);
            dds_builtintopic_free_endpoint(each);
        }
    }
    return is_so;
}

static bool heard_by(void *carrier, fsm_link *link, uint8_t peer, uint32_t session,
                     uint32_t timeout_ms)
{
    const fsm_link_ros *ros = carrier;
    dds_time_t end = dds_time() + DDS_MSECS((int64_t)timeout_ms);
    (void)link;
    while (!listens(ros, peer, session)) {
        if (dds_time() >= end) {
            return false;
        }
        dds_sleepfor(DDS_MSECS(1));
    }
    return true;
}

/* ---- a transport ------------------------------------------------------------------------------ */

static int open_reader(fsm_link_ros *ros, uint8_t peer, dds_entity_t topic, const dds_qos_t *qos)
{
    dds_entity_t reader = dds_create_reader(ros->participant, topic, qos, NULL);
    dds_entity_t condition = reader > 0 ? dds_create_readcondition(reader, DDS_ANY_STATE) : reader;
    if (condition < 0) {
        return condition;
    }
    ros->readers[peer] = reader;
    return dds_waitset_attach(ros->waitset, condition, 0);
}

static int open_ends(fsm_link_ros *ros, const fsm_link_ros_net *net, const dds_qos_t *qos)
{
    const fsm_link_map *map = ros->link->map;
    ros->waitset = dds_create_waitset(ros->participant);
    ros->wake = dds_create_guardcondition(ros->participant);
    if (ros->waitset < 0 || ros->wake < 0 ||
        dds_waitset_attach(ros->waitset, ros->wake, 0) != DDS_RETCODE_OK) {
        return DDS_RETCODE_OUT_OF_RESOURCES;
    }
    for (uint8_t node = 0u; node < map->nodes; node++) {
        dds_entity_t topic;
        int error = 0;
        if (net->topic[node] == NULL) {
            continue;
        }
        topic = dds_create_topic(ros->participant, &std_msgs_msg_dds__UInt8MultiArray__desc,
                                 net->topic[node], NULL, NULL);
        if (topic < 0) {
            return topic;
        }
        if (node == map->node) {
            ros->writer = dds_create_writer(ros->participant, topic, qos, NULL);
            error = ros->writer < 0 ? ros->writer : 0;
        } else {
            error = open_reader(ros, node, topic, qos);
        }
        if (error != 0) {
            return error;
        }
    }
    return 0;
}

static int join(fsm_link_ros *ros, const fsm_link_ros_net *net, int priority)
{
    dds_data_representation_id_t plain = DDS_DATA_REPRESENTATION_XCDR1; /* as ROS */
    fsm_dds_domain domain;
    uint8_t tag[TAG];
    dds_qos_t *qos;
    int error;
    domain.id = net->domain;
    domain.is_insecure = ros->link->map->is_insecure;
    domain.priority = priority;
    ros->participant = fsm_dds_join(&domain);
    if (ros->participant < 0) {
        return ros->participant;
    }
    tag_of(ros->link, ros->link->session, tag);
    qos = dds_create_qos();
    dds_qset_reliability(qos, DDS_RELIABILITY_RELIABLE, 0);
    dds_qset_history(qos, DDS_HISTORY_KEEP_LAST, FSM_LINK_ROS_WAITING);
    dds_qset_ignorelocal(qos, DDS_IGNORELOCAL_PARTICIPANT);
    dds_qset_data_representation(qos, 1u, &plain);
    dds_qset_userdata(qos, tag, TAG);
    error = open_ends(ros, net, qos);
    dds_delete_qos(qos);
    return error;
}

static int start(pthread_t *thread, bool *has_thread, void *(*run)(void *), fsm_link_ros *ros,
                 int priority)
{
    int error = pthread_create(thread, NULL, run, ros);
    *has_thread = error == 0;
    if (error == 0 && priority > 0) {
        struct sched_param wish;
        memset(&wish, 0, sizeof wish);
        wish.sched_priority = priority;
        error = pthread_setschedparam(*thread, SCHED_FIFO, &wish);
    }
    return error;
}

static const fsm_link_transport transport = {wake, NULL, heard_by, false};

int fsm_link_ros_open(fsm_link_ros *ros, fsm_link *link, const fsm_link_ros_net *net, int priority)
{
    int error;
    memset(ros, 0, sizeof *ros);
    ros->link = link;
    error = sem_init(&ros->work, 0, 0u) == 0 ? 0 : errno;
    ros->has_work = error == 0;
    if (error == 0) {
        error = join(ros, net, priority);
    }
    if (error == 0) {
        fsm_link_attach(link, &transport, ros);
        error = start(&ros->sender, &ros->has_sender, run_sender, ros, priority);
    }
    if (error == 0) {
        error = start(&ros->receiver, &ros->has_receiver, run_receiver, ros, priority);
    }
    if (error != 0) {
        fsm_link_ros_close(ros);
    }
    return error;
}

uint32_t fsm_link_ros_count(const fsm_link_ros *ros, fsm_link_ros_counter what)
{
    return what < FSM_LINK_ROS_COUNTS ? (uint32_t)fsm_shared_read(&ros->counts[what]) : 0u;
}

void fsm_link_ros_close(fsm_link_ros *ros)
{
    fsm_link_attach(ros->link, NULL, NULL);
    fsm_shared_write(&ros->stop, 1u);
    if (ros->has_sender) {
        (void)sem_post(&ros->work);
        (void)pthread_join(ros->sender, NULL);
    }
    if (ros->has_receiver) {
        (void)dds_set_guardcondition(ros->wake, true);
        (void)pthread_join(ros->receiver, NULL);
    }
    if (ros->has_work) {
        (void)sem_destroy(&ros->work);
    }
    fsm_dds_leave(ros->participant);
    ros->participant = 0;
    ros->has_sender = ros->has_receiver = ros->has_work = false;
}
