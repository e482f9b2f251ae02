// What the page knows: the bench's view, a signal per field, and what the page itself has chosen.
import { batch, computed, signal } from '@preact/signals'
import { EMPTY } from './words.js'

/**
 * @import { Signal } from '@preact/signals'
 * @import { Connection } from './types'
 * @import { View } from './wire'
 */

/** @type {{ [Field in keyof View]: Signal<View[Field]> }} */
// @ts-ignore: the type of an object's entries is not that of each
export const view = Object.fromEntries(Object.entries(EMPTY).map(([field, value]) => [field, signal(value)]))

/** @type {Signal<Connection>} */
export const connection = signal('connecting')
/** The number of this page among the clients, and the bench's version. */
export const client = signal(null)
export const version = signal('')

export const hasControl = computed(() => connection.value === 'open' && view.control.value.holder === client.value)
/** Whether something on the bus can be changed from here; why not, as a key of the dictionary. */
export const whyNot = computed(() => {
  if (connection.value !== 'open') return 'control.lost'
  if (!view.bus.value.is_writable) return 'control.read-only'
  return hasControl.value ? null : 'control.first'
})

/**
 * Takes over the fields of a view that have changed. Fields that the page does not know are left alone.
 * @param {Partial<View>} changes
 */
export function applyView(changes) {
  batch(() => {
    for (const [field, value] of Object.entries(changes)) if (field in view) view[field].value = value
  })
}

/**
 * How the last stop went, by what the drives have confirmed since: one that was refused is sent until each drive stands. `last` is that of
 * bench.js.
 */
export function stopSince(last, drives) {
  if (last?.state !== 'refused') return last
  if (drives.some((drive) => drive.unconfirmed)) return last.isSent ? last : { ...last, isSent: true }
  return last.isSent ? { ...last, state: 'confirmed' } : last
}

export const TABS = ['nodes', 'objects', 'pdos', 'trace', 'plots', 'drives', 'bus', 'devices']

/** `#objects/5`: the tab, and the node that is looked at. */
export function parsePlace(hash) {
  const [tab, node] = hash.replace(/^#/, '').split('/')
  const id = Number(node)
  return { tab: TABS.includes(tab) ? tab : 'nodes', node: Number.isInteger(id) && id >= 1 && id <= 127 ? id : null }
}

const place = parsePlace(globalThis.location?.hash ?? '')
export const tab = signal(place.tab)
export const chosenNode = signal(place.node)

/** The node that is looked at: the chosen one, else the first. */
export const node = computed(() => {
  const nodes = view.nodes.value
  return nodes.find((each) => each.id === chosenNode.value) ?? nodes[0] ?? null
})
export const nodeId = computed(() => node.value?.id ?? null)

export function goTo(nextTab, nextNode = chosenNode.value) {
  batch(() => {
    tab.value = nextTab
    chosenNode.value = nextNode
  })
  history.replaceState(null, '', nextNode === null ? `#${nextTab}` : `#${nextTab}/${nextNode}`)
}

/** The number of the trace's row that is to be shown, until it is. */
export const wantedRow = signal(null)

export function goToRow(number) {
  wantedRow.value = number
  goTo('trace')
}
