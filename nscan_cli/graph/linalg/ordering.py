"""An order of little fill for a sparse symmetric matrix: approximate minimum degree.

P. Amestoy, T. Davis, I. Duff, "An approximate minimum degree ordering algorithm", 1996. A node that is
eliminated leaves an element: the nodes that it joins, each with each. An element that lies within a newer one
is forgotten, and nodes that touch the same are eliminated together: the first stands for all.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from nscan_cli.kernels.decorators import kernel, leaf_kernel
from nscan_cli.poses import Indices


class Around(NamedTuple):
    """What each of F nodes touches: nodes, and elements, which take the places of nodes."""

    indptr: Indices
    """(F + 1,) where its room begins and ends."""
    names: Indices
    """Nodes from the beginning of the room, elements back from its end."""
    nodes: Indices
    """(F,) how many nodes."""
    elements: Indices
    """(F,) how many elements."""
    weights: Indices
    """(F,) how many nodes it stands for; 0 when it has been eliminated or another stands for it."""


class Elements(NamedTuple):
    """Each has the name of the node that left it."""

    begins: Indices
    """(F,) where its nodes begin among the members."""
    counts: Indices
    """(F,) how many members."""
    sizes: Indices
    """(F,) how many nodes these stand for; 0 when it is forgotten."""
    outside: Indices
    """(F,) how many of them are not in the newest element."""


class Groups(NamedTuple):
    """Nodes that are eliminated together; −1 where there is none."""

    following: Indices
    """(F,) the next node of the same group."""
    last: Indices
    """(F,) the last one of the group that a node stands for."""
    of_sum: Indices
    """(F,) the last node whose names have this sum, modulo F."""
    before: Indices
    """(F,) the one before it."""


class Queue(NamedTuple):
    """The nodes that are left, by their degree; −1 where there is none."""

    first: Indices
    """(F,) of each degree."""
    after: Indices
    """(F,) the next node of the same degree."""
    before: Indices
    """(F,) the one before."""


@kernel
def order_of_little_fill(indptr: Indices, indices: Indices) -> Indices:
    """The row (F,) of each node, from the nodes that each touches, itself perhaps among them."""
    nodes = indptr.shape[0] - 1
    none, zero = np.full(nodes, -1), np.zeros(nodes, np.int64)
    around = Around(indptr, indices.copy(), zero.copy(), zero.copy(), np.ones(nodes, np.int64))
    elements = Elements(zero.copy(), zero.copy(), zero.copy(), zero.copy())
    queue, degrees = Queue(none.copy(), none.copy(), none.copy()), zero.copy()
    for node in range(nodes - 1, -1, -1):
        _leave_out_itself(around, node)
        degrees[node] = around.nodes[node]
        _put(queue, node, degrees[node])
    groups = Groups(none.copy(), np.arange(nodes), none.copy(), none.copy())
    place, members = zero, np.empty(2 * nodes, np.int64)
    seen, counted = none.copy(), none
    placed, end, least = 0, 0, 0
    while placed < nodes:
        while queue.first[least] < 0:
            least += 1
        pivot = node = queue.first[least]
        _take(queue, pivot, least)
        around.weights[pivot] = 0
        while node >= 0:
            place[node] = placed
            placed += 1
            node = groups.following[node]
        if members.shape[0] < end + nodes:
            members = np.concatenate((members[:end], np.empty(end + nodes, np.int64)))
        size = _make_element(around, elements, members, end, pivot, seen)
        begin, end = end, end + elements.counts[pivot]
        joined = members[begin:end]
        _count_outside(around, elements, joined, pivot, counted)
        for node in joined:
            _take(queue, node, degrees[node])
            beyond, inside = _renew(around, elements, node, pivot, seen), size - around.weights[node]
            degrees[node] = min(
                nodes - placed - around.weights[node], degrees[node] + inside, beyond + inside
            )
        _group_alike(around, groups, joined, degrees)
        for node in joined:
            if around.weights[node] > 0:
                _put(queue, node, degrees[node])
                least = min(least, degrees[node])
    return place


@leaf_kernel
def _leave_out_itself(around: Around, node: int) -> None:
    """Let all others that stand in a node's room be the nodes that it touches."""
    low, kept = around.indptr[node], 0
    for p in range(low, around.indptr[node + 1]):
        if around.names[p] != node:
            around.names[low + kept] = around.names[p]
            kept += 1
    around.nodes[node] = kept


@leaf_kernel
def _make_element(
    around: Around, elements: Elements, members: Indices, begin: int, pivot: int, seen: Indices
) -> int:
    """All that the pivot touches, by itself or by its elements, which are forgotten; how many these are."""
    low, high, end, size = around.indptr[pivot], around.indptr[pivot + 1], begin, 0
    for p in range(low, low + around.nodes[pivot]):
        end = _enter(members, end, around.names[p], seen, pivot, around.weights)
    for p in range(high - around.elements[pivot], high):
        element = around.names[p]
        for q in range(elements.begins[element], elements.begins[element] + elements.counts[element]):
            end = _enter(members, end, members[q], seen, pivot, around.weights)
        elements.sizes[element] = 0
    for q in range(begin, end):
        size += around.weights[members[q]]
    elements.begins[pivot], elements.counts[pivot], elements.sizes[pivot] = begin, end - begin, size
    return size


@leaf_kernel
def _count_outside(around: Around, elements: Elements, joined: Indices, pivot: int, counted: Indices) -> None:
    """Of each other element that the nodes of the new one touch: how many of its nodes are not among them."""
    for q in range(joined.shape[0]):
        node = joined[q]
        high = around.indptr[node + 1]
        for p in range(high - around.elements[node], high):
            element = around.names[p]
            if counted[element] != pivot:
                counted[element], elements.outside[element] = pivot, elements.sizes[element]
            elements.outside[element] -= around.weights[node]


@leaf_kernel
def _group_alike(around: Around, groups: Groups, joined: Indices, degrees: Indices) -> None:
    """Let one of those that touch the same stand for all; only such as have the same sum are compared."""
    nodes = around.nodes.shape[0]
    for q in range(joined.shape[0]):
        node = joined[q]
        named = _sum(around, node) % nodes
        earlier = groups.of_sum[named]
        while earlier >= 0 and not _alike(around, earlier, node):
            earlier = groups.before[earlier]
        if earlier < 0:
            groups.before[node], groups.of_sum[named] = groups.of_sum[named], node
            continue
        groups.following[groups.last[earlier]], groups.last[earlier] = node, groups.last[node]
        around.weights[earlier] += around.weights[node]
        degrees[earlier] -= around.weights[node]
        around.weights[node] = 0
    for q in range(joined.shape[0]):
        groups.of_sum[_sum(around, joined[q]) % nodes] = -1


@leaf_kernel
def _enter(members: Indices, end: int, node: int, seen: Indices, pivot: int, weights: Indices) -> int:
    if seen[node] != pivot and weights[node] > 0:
        seen[node] = pivot
        members[end] = node
        end += 1
    return end


@leaf_kernel
def _renew(around: Around, elements: Elements, node: int, pivot: int, seen: Indices) -> int:
    """Note what a node of the new element touches now; how many nodes that may be outside of it."""
    names, low, high = around.names, around.indptr[node], around.indptr[node + 1]
    kept, beyond, at = 0, 0, high
    for p in range(low, low + around.nodes[node]):
        if seen[names[p]] != pivot and around.weights[names[p]] > 0:
            names[low + kept] = names[p]
            kept += 1
            beyond += around.weights[names[p]]
    for p in range(high - 1, high - 1 - around.elements[node], -1):
        element = names[p]
        if elements.sizes[element] > 0 and elements.outside[element] > 0:
            beyond += elements.outside[element]
            at -= 1
            names[at] = element
    names[at - 1] = pivot
    around.nodes[node], around.elements[node] = kept, high - at + 1
    return beyond


@leaf_kernel
def _sum(around: Around, node: int) -> int:
    low, high, total = around.indptr[node], around.indptr[node + 1], 0
    for p in range(low, low + around.nodes[node]):
        total += around.names[p]
    for p in range(high - around.elements[node], high):
        total += around.names[p]
    return total


@leaf_kernel
def _alike(around: Around, a: int, b: int) -> bool:
    """Whether two nodes touch the same nodes and elements."""
    indptr, nodes, elements = around.indptr, around.nodes[a], around.elements[a]
    if nodes != around.nodes[b] or elements != around.elements[b]:
        return False
    low, high = indptr[a], indptr[a + 1]
    other_low, other_high = indptr[b], indptr[b + 1]
    return _same(around.names[low : low + nodes], around.names[other_low : other_low + nodes]) and _same(
        around.names[high - elements : high], around.names[other_high - elements : other_high]
    )


@leaf_kernel
def _same(some: Indices, others: Indices) -> bool:
    """Whether each of some names, all different, is among others, which are as many."""
    for p in range(some.shape[0]):
        found = False
        for q in range(others.shape[0]):
            found |= some[p] == others[q]
        if not found:
            return False
    return True


@leaf_kernel
def _put(queue: Queue, node: int, degree: int) -> None:
    other = queue.first[degree]
    queue.first[degree], queue.after[node], queue.before[node] = node, other, -1
    if other >= 0:
        queue.before[other] = node


@leaf_kernel
def _take(queue: Queue, node: int, degree: int) -> None:
    before, after = queue.before[node], queue.after[node]
    if before >= 0:
        queue.after[before] = after
    else:
        queue.first[degree] = after
    if after >= 0:
        queue.before[after] = before
