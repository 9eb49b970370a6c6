//! A file system in user space that forgets, at a power cut, whatever was not synced.
//!
//! The kernel hands every write to it at once. A file's bytes are durable from its next `fsync` on, a name in a folder from
//! the folder's `fsync` on, as POSIX promises and no more.

use fuser::{
    BackgroundSession, Config, Errno, FileAttr, FileHandle, FileType, Filesystem, FopenFlags, Generation, INodeNo,
    LockOwner, OpenFlags, RenameFlags, ReplyAttr, ReplyCreate, ReplyData, ReplyDirectory, ReplyEmpty, ReplyEntry,
    ReplyOpen, ReplyWrite, Request, TimeOrNow, WriteFlags,
};
use std::collections::BTreeMap;
use std::ffi::{OsStr, OsString};
use std::io;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, MutexGuard};
use std::time::{Duration, SystemTime, UNIX_EPOCH};

/// The kernel asks again every time.
const TTL: Duration = Duration::ZERO;

/// A mounted disk; unmounted when dropped.
pub struct VolatileDisk {
    nodes: Arc<Mutex<Nodes>>,
    _session: BackgroundSession,
}

impl VolatileDisk {
    /// Mounts an empty disk.
    pub fn mount(at: &Path) -> io::Result<VolatileDisk> {
        let nodes = Arc::new(Mutex::new(Nodes { all: BTreeMap::from([(1, Node::folder())]) }));
        let session = fuser::spawn_mount(Volatile(nodes.clone()), at, &Config::default())?;
        Ok(VolatileDisk { nodes, _session: session })
    }

    /// Files that a power cut would leave now, by path. Of each file the first bytes are those of the last sync; of what
    /// was written since, `torn` decides, given the number of bytes.
    pub fn after_power_cut(&self, torn: impl Fn(&[u8]) -> Vec<u8>) -> BTreeMap<PathBuf, Vec<u8>> {
        let nodes = self.nodes.lock().unwrap();
        let mut found = BTreeMap::new();
        let mut open = vec![(PathBuf::new(), 1)];
        while let Some((path, ino)) = open.pop() {
            match &nodes.all[&ino] {
                Node::Folder { durable, .. } => {
                    open.extend(durable.iter().map(|(name, child)| (path.join(name), *child)));
                }
                Node::File { bytes, durable } => {
                    let mut left = durable.clone();
                    if bytes.starts_with(durable) {
                        left.extend(torn(&bytes[durable.len()..]));
                    }
                    found.insert(path, left);
                }
            }
        }
        found
    }
}

enum Node {
    Folder { entries: BTreeMap<OsString, u64>, durable: BTreeMap<OsString, u64> },
    File { bytes: Vec<u8>, durable: Vec<u8> },
}

impl Node {
    fn folder() -> Node {
        Node::Folder { entries: BTreeMap::new(), durable: BTreeMap::new() }
    }

    fn attributes(&self, ino: u64) -> FileAttr {
        let (kind, size) = match self {
            Node::Folder { .. } => (FileType::Directory, 0),
            Node::File { bytes, .. } => (FileType::RegularFile, bytes.len() as u64),
        };
        FileAttr {
            ino: INodeNo(ino),
            size,
            blocks: size.div_ceil(512),
            atime: UNIX_EPOCH,
            mtime: UNIX_EPOCH,
            ctime: UNIX_EPOCH,
            crtime: UNIX_EPOCH,
            kind,
            perm: 0o777,
            nlink: 1,
            uid: 0,
            gid: 0,
            rdev: 0,
            blksize: 4096,
            flags: 0,
        }
    }
}

/// All files and folders, by number; the first is the root.
struct Nodes {
    all: BTreeMap<u64, Node>,
}

impl Nodes {
    fn entries(&mut self, folder: INodeNo) -> Result<&mut BTreeMap<OsString, u64>, Errno> {
        match self.all.get_mut(&u64::from(folder)) {
            Some(Node::Folder { entries, .. }) => Ok(entries),
            Some(Node::File { .. }) => Err(Errno::ENOTDIR),
            None => Err(Errno::ENOENT),
        }
    }

    fn bytes(&mut self, file: INodeNo) -> Result<&mut Vec<u8>, Errno> {
        match self.all.get_mut(&u64::from(file)) {
            Some(Node::File { bytes, .. }) => Ok(bytes),
            Some(Node::Folder { .. }) => Err(Errno::EISDIR),
            None => Err(Errno::ENOENT),
        }
    }

    fn attributes(&self, ino: u64) -> Result<FileAttr, Errno> {
        self.all.get(&ino).map(|node| node.attributes(ino)).ok_or(Errno::ENOENT)
    }

    fn add(&mut self, parent: INodeNo, name: &OsStr, node: Node) -> Result<FileAttr, Errno> {
        let ino = self.all.keys().last().map_or(1, |last| last + 1);
        self.entries(parent)?.insert(name.to_os_string(), ino);
        self.all.insert(ino, node);
        self.attributes(ino)
    }

    fn sync(&mut self, ino: INodeNo) {
        match self.all.get_mut(&u64::from(ino)) {
            Some(Node::Folder { entries, durable }) => durable.clone_from(entries),
            Some(Node::File { bytes, durable }) => durable.clone_from(bytes),
            None => {}
        }
    }
}

struct Volatile(Arc<Mutex<Nodes>>);

impl Volatile {
    fn nodes(&self) -> MutexGuard<'_, Nodes> {
        self.0.lock().unwrap()
    }
}

impl Filesystem for Volatile {
    fn lookup(&self, _: &Request, parent: INodeNo, name: &OsStr, reply: ReplyEntry) {
        let mut nodes = self.nodes();
        let ino = nodes.entries(parent).and_then(|entries| entries.get(name).copied().ok_or(Errno::ENOENT));
        match ino.and_then(|ino| nodes.attributes(ino)) {
            Ok(attributes) => reply.entry(&TTL, &attributes, Generation(0)),
            Err(error) => reply.error(error),
        }
    }

    fn getattr(&self, _: &Request, ino: INodeNo, _: Option<FileHandle>, reply: ReplyAttr) {
        match self.nodes().attributes(u64::from(ino)) {
            Ok(attributes) => reply.attr(&TTL, &attributes),
            Err(error) => reply.error(error),
        }
    }

    fn setattr(
        &self,
        _: &Request,
        ino: INodeNo,
        _: Option<u32>,
        _: Option<u32>,
        _: Option<u32>,
        size: Option<u64>,
        _: Option<TimeOrNow>,
        _: Option<TimeOrNow>,
        _: Option<SystemTime>,
        _: Option<FileHandle>,
        _: Option<SystemTime>,
        _: Option<SystemTime>,
        _: Option<SystemTime>,
        _: Option<fuser::BsdFileFlags>,
        reply: ReplyAttr,
    ) {
        let mut nodes = self.nodes();
        if let (Some(size), Ok(bytes)) = (size, nodes.bytes(ino)) {
            bytes.resize(size as usize, 0);
        }
        match nodes.attributes(u64::from(ino)) {
            Ok(attributes) => reply.attr(&TTL, &attributes),
            Err(error) => reply.error(error),
        }
    }

    fn mkdir(&self, _: &Request, parent: INodeNo, name: &OsStr, _: u32, _: u32, reply: ReplyEntry) {
        match self.nodes().add(parent, name, Node::folder()) {
            Ok(attributes) => reply.entry(&TTL, &attributes, Generation(0)),
            Err(error) => reply.error(error),
        }
    }

    fn create(&self, _: &Request, parent: INodeNo, name: &OsStr, _: u32, _: u32, _: i32, reply: ReplyCreate) {
        match self.nodes().add(parent, name, Node::File { bytes: Vec::new(), durable: Vec::new() }) {
            Ok(made) => reply.created(&TTL, &made, Generation(0), FileHandle(0), FopenFlags::empty()),
            Err(error) => reply.error(error),
        }
    }

    fn open(&self, _: &Request, _: INodeNo, _: OpenFlags, reply: ReplyOpen) {
        reply.opened(FileHandle(0), FopenFlags::empty());
    }

    fn read(
        &self,
        _: &Request,
        ino: INodeNo,
        _: FileHandle,
        offset: u64,
        size: u32,
        _: OpenFlags,
        _: Option<LockOwner>,
        reply: ReplyData,
    ) {
        match self.nodes().bytes(ino) {
            Ok(bytes) => {
                let start = (offset as usize).min(bytes.len());
                reply.data(&bytes[start..bytes.len().min(start + size as usize)]);
            }
            Err(error) => reply.error(error),
        }
    }

    fn write(
        &self,
        _: &Request,
        ino: INodeNo,
        _: FileHandle,
        offset: u64,
        data: &[u8],
        _: WriteFlags,
        _: OpenFlags,
        _: Option<LockOwner>,
        reply: ReplyWrite,
    ) {
        match self.nodes().bytes(ino) {
            Ok(bytes) => {
                let end = offset as usize + data.len();
                bytes.resize(bytes.len().max(end), 0);
                bytes[offset as usize..end].copy_from_slice(data);
                reply.written(data.len() as u32);
            }
            Err(error) => reply.error(error),
        }
    }

    fn rename(
        &self,
        _: &Request,
        parent: INodeNo,
        name: &OsStr,
        new_parent: INodeNo,
        new_name: &OsStr,
        _: RenameFlags,
        reply: ReplyEmpty,
    ) {
        let mut nodes = self.nodes();
        let moved = nodes.entries(parent).and_then(|entries| entries.remove(name).ok_or(Errno::ENOENT));
        let done = moved.and_then(|ino| nodes.entries(new_parent).map(|to| to.insert(new_name.into(), ino)));
        match done {
            Ok(_) => reply.ok(),
            Err(error) => reply.error(error),
        }
    }

    fn flush(&self, _: &Request, _: INodeNo, _: FileHandle, _: LockOwner, reply: ReplyEmpty) {
        reply.ok();
    }

    fn fsync(&self, _: &Request, ino: INodeNo, _: FileHandle, _: bool, reply: ReplyEmpty) {
        self.nodes().sync(ino);
        reply.ok();
    }

    fn fsyncdir(&self, _: &Request, ino: INodeNo, _: FileHandle, _: bool, reply: ReplyEmpty) {
        self.nodes().sync(ino);
        reply.ok();
    }

    fn readdir(&self, _: &Request, ino: INodeNo, _: FileHandle, offset: u64, mut reply: ReplyDirectory) {
        let mut nodes = self.nodes();
        let names: Vec<(OsString, u64)> = match nodes.entries(ino) {
            Ok(entries) => entries.iter().map(|(name, ino)| (name.clone(), *ino)).collect(),
            Err(error) => return reply.error(error),
        };
        for (n, (name, ino)) in names.into_iter().enumerate().skip(offset as usize) {
            let kind = nodes.all[&ino].attributes(ino).kind;
            if reply.add(INodeNo(ino), n as u64 + 1, kind, name) {
                break;
            }
        }
        reply.ok();
    }
}
