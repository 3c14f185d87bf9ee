/* A ring of K machines that pass on tokens and messages, event by event like node.yaml. A queue has
 * room for two; who would fill one that is full waits. */
#define K 8
#define TOKEN 1
#define MESSAGE 2
#define IDLE 0
#define WAITING 1
#define HOLDING 2
#define next ((_pid + 1) % K)

chan queue[K] = [2] of { byte };
byte does[K] = { HOLDING, IDLE, IDLE, HOLDING, IDLE, IDLE, HOLDING, IDLE };

active [K] proctype node()
{
end:
    do
    :: d_step { does[_pid] == IDLE -> does[_pid] = WAITING }
    :: d_step { does[_pid] == HOLDING && empty(queue[next]) ->
                does[_pid] = IDLE; queue[next]!MESSAGE; queue[next]!TOKEN }
    :: d_step { queue[_pid]?[TOKEN] && does[_pid] != WAITING && nfull(queue[next]) ->
                queue[_pid]?TOKEN; queue[next]!TOKEN }
    :: d_step { queue[_pid]?[TOKEN] && does[_pid] == WAITING -> queue[_pid]?TOKEN; does[_pid] = HOLDING }
    :: d_step { queue[_pid]?[MESSAGE] && does[_pid] != WAITING -> queue[_pid]?MESSAGE }
    :: d_step { queue[_pid]?[MESSAGE] && does[_pid] == WAITING && nfull(queue[next]) ->
                queue[_pid]?MESSAGE; queue[next]!MESSAGE }
    od
}
